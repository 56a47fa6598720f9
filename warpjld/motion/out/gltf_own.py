"""The glTF document that a rig was read from, opened again to add a motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from warpjld.errors import InputError
from warpjld.motion.out.glb_file import GlbFile, read_gltf_json
from warpjld.motion.out.local_motion import rest_scales
from warpjld.motion.out.node_tree import NodeTree
from warpjld.motion.out.source_motion import SourceMotion
from warpjld.rig import Rig

if TYPE_CHECKING:
    from warpjld.io.gltf.document import Document

__all__ = ["own_document"]

_MEDIA = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".webp": "image/webp",
    ".ktx2": "image/ktx2",
}
_SAME = 1e-6  # tolerance of joint transforms against those loaded, per largest number


def own_document(
    rig: Rig, motion: SourceMotion, notes: list[str], warnings: list[str]
) -> tuple[GlbFile, NodeTree] | None:
    """The rig's own document and its nodes; None if the rig's joints are not those of a glTF file."""
    if rig.path is None or rig.path.suffix.lower() not in (".glb", ".gltf"):
        return None
    from warpjld.io.gltf.document import open_document
    from warpjld.io.gltf.skin import joint_nodes, joint_tree

    document = open_document(rig.path)
    if not document.gltf.skins:
        return None  # a bare surface with a skeleton file
    joints = joint_nodes(document)
    tree = joint_tree(document, joints)
    if len(tree) != len(motion.tree) or not np.allclose(
        tree.frames, motion.tree.frames, rtol=0.0, atol=_SAME * np.abs(motion.tree.frames).max()
    ):
        notes.append(f"the rig's joints are not those of {rig.path.name}: written as a file of its own")
        return None
    content = read_gltf_json(rig.path.read_bytes())
    lengths = [buffer["byteLength"] for buffer in content.get("buffers", ())]
    file = GlbFile(content, [data[:length] for data, length in zip(document.buffers, lengths, strict=True)])
    _take_in_pictures(file, rig.path.parent, warnings)
    return file, _nodes(document, joints, content, motion)


def _nodes(document: Document, joints: list[int], content: dict[str, Any], motion: SourceMotion) -> NodeTree:
    chosen: dict[int, None] = {}
    for joint in joints:
        above = joint
        while above >= 0 and above not in chosen:
            chosen[above] = None
            above = int(document.parents[above])
    numbers = np.array(list(chosen))
    place = {int(number): n for n, number in enumerate(numbers)}
    rest = np.array([document.local(int(number)) for number in numbers])
    scales = rest_scales(rest)
    for n, number in enumerate(numbers):
        record = content["nodes"][number]
        if "matrix" not in record:  # scale as stated, with its signs
            scales[n] = record.get("scale", (1.0, 1.0, 1.0))
    return NodeTree(
        records=content["nodes"],
        numbers=numbers,
        parents=np.array([place.get(int(document.parents[number]), -1) for number in numbers]),
        rest=rest,
        rest_worlds=document.worlds[numbers],
        scales=scales,
        joints=np.array([place[joint] for joint in joints]),
        worlds=motion.worlds,
    )


def _take_in_pictures(file: GlbFile, folder: Path, warnings: list[str]) -> None:
    """Embed images of a .gltf file in the binary content."""
    for picture in file.content.get("images", ()):
        uri = picture.get("uri")
        if uri is None or uri.startswith("data:"):
            continue
        try:
            data = (folder / unquote(uri)).read_bytes()
        except OSError as error:
            warnings.append(
                f"picture '{uri}' cannot be read ({error.strerror}): the output refers to it, but does not contain it"
            )
            continue
        kind = picture.get("mimeType") or _MEDIA.get(Path(unquote(uri)).suffix.lower())
        if kind is None:
            raise InputError(f"picture '{uri}': want one of {', '.join(_MEDIA)} to put it into the file")
        del picture["uri"]
        picture |= {"bufferView": file.add_view(data), "mimeType": kind}
