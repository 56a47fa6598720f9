"""Reader of VRM animations (.vrma): glTF animations of a humanoid's bones, which the file names in a table."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.motion.joint_animation import JointAnimation, streamed_animation
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["read_vrma"]

_TRUNK = {"pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck1": "Neck", "head": "Head"}
_LIMBS = {
    "clavicle": "Shoulder",
    "shoulder": "Arm",
    "elbow": "ForeArm",
    "wrist": "Hand",
    "hip": "UpLeg",
    "knee": "Leg",
    "ankle": "Foot",
    "ball": "ToeBase",
}
_FINGER = {"base": 1, "knuckle2": 2, "knuckle3": 3}


def read_vrma(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of a .vrma file, its joints under Mixamo's names, independent of the nodes' names.

    The file's rest pose is a T-pose. Facial expressions and the eyes' direction are ignored.

    Args:
        path: The file.
        rate: Frames a second; None for the file's own.
        name: Name of the animation; None for the first.

    Raises:
        InputError: Not a glTF file, no ``VRMC_vrm_animation``, or invalid data.
    """
    from warpjld.io.gltf.document import open_document
    from warpjld.io.gltf.skin import joint_nodes
    from warpjld.io.vrm_humanoid import humanoid_nodes
    from warpjld.motion.gltf_animation import read_gltf_animation

    document = open_document(path)
    stated = humanoid_nodes(document, ("VRMC_vrm_animation",))
    animation = read_gltf_animation(path, rate=rate, name=name)
    nodes = joint_nodes(document) if document.gltf.skins else list(range(len(document.gltf.nodes)))
    chosen = {nodes.index(node): joint for joint, node in stated.items() if node in nodes}
    if not chosen:
        raise InputError("VRMC_vrm_animation: no bone of its humanoid table is animated", path=path)
    joints = list(chosen)
    place = {j: k for k, j in enumerate(joints)}
    parents = [next((place[a] for a in animation.tree.ancestors(j) if a in place), -1) for j in joints]
    tree = SourceTree(tuple(_word(chosen[j]) for j in joints), np.array(parents), animation.tree.frames[joints])

    def some(frames: slice) -> JointAnimation:
        block = animation[frames]
        return replace(block.plain(), tree=tree, worlds=block.worlds[:, joints])

    return streamed_animation(len(animation), some)


def _word(joint: str) -> str:
    """Mixamo's name of a canonical joint: ``left.index.base`` → ``LeftHandIndex1``."""
    if joint in _TRUNK:
        return _TRUNK[joint]
    side, _, part = joint.partition(".")
    digit, _, number = part.partition(".")
    return side.capitalize() + (f"Hand{digit.capitalize()}{_FINGER[number]}" if number else _LIMBS[part])
