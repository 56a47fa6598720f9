"""Reader of VRM avatars as :class:`SourceRig`: binary glTF with a table of humanoid joints."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from warpjld.io.gltf.document import open_document
from warpjld.io.gltf.skin import joint_nodes, joint_tree, read_gltf_rig
from warpjld.io.source import SourceRig
from warpjld.io.vrm_humanoid import humanoid_nodes

__all__ = ["read_vrm_rig"]


def read_vrm_rig(path: str | Path) -> SourceRig:
    """Read a .vrm file, version 0.x or 1.0.

    Joints of its humanoid table that no skin uses become joints, too. Joints of hair and skirts (spring bones) are
    joints like all others.

    Raises:
        InputError: Not glTF, no skin, no humanoid table, or invalid data.
    """
    rig = read_gltf_rig(path)
    document = open_document(path)
    stated = humanoid_nodes(document)
    nodes = joint_nodes(document)
    nodes += [node for node in stated.values() if node not in nodes]
    number = {node: j for j, node in enumerate(nodes)}
    return replace(rig, tree=joint_tree(document, nodes), stated={name: number[node] for name, node in stated.items()})
