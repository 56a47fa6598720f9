"""The humanoid table of VRM files, which assigns nodes to the bones of a person.

VRM 1.0 (``VRMC_vrm``) and its animations (``VRMC_vrm_animation``) store a node per bone; VRM 0.x (``VRM``) a list of
pairs, in which thumb joints have the name of the next joint: its Proximal is Metacarpal in 1.0.
Sources: https://github.com/vrm-c/vrm-specification, VRMC_vrm-1.0/humanoid.md and 0.0/README.md.
"""

from __future__ import annotations

from typing import Any

from warpjld.errors import InputError
from warpjld.io.gltf.document import Document

__all__ = ["humanoid_nodes"]

_TRUNK = ("spine", "chest", "upperChest")
_LIMBS = {
    "Shoulder": "clavicle",
    "UpperArm": "shoulder",
    "LowerArm": "elbow",
    "Hand": "wrist",
    "UpperLeg": "hip",
    "LowerLeg": "knee",
    "Foot": "ankle",
    "Toes": "ball",
}
_DIGITS = {"Little": "pinky", "Ring": "ring", "Middle": "middle", "Index": "index"}
_FINGER = {"Proximal": "base", "Intermediate": "knuckle2", "Distal": "knuckle3"}
_THUMB = {"Metacarpal": "base", "Proximal": "knuckle2", "Distal": "knuckle3"}


def humanoid_nodes(document: Document, extensions: tuple[str, ...] = ("VRMC_vrm", "VRM")) -> dict[str, int]:
    """Canonical joint → node, as stated in the file; eyes and jaw are ignored.

    Args:
        document: The file.
        extensions: Extensions that may hold the table; the first present one is used.

    Raises:
        InputError: No such extension, or an invalid table.
    """
    content = document.gltf.extensions or {}
    name = next((e for e in extensions if e in content), None)
    if name is None:
        raise InputError(f"has no {' or '.join(extensions)} extension", path=document.path)
    try:
        bones = content[name]["humanoid"]["humanBones"]
        if name == "VRM":
            nodes = {str(bone["bone"]): bone["node"] for bone in bones}
        else:
            nodes = {str(bone): entry["node"] for bone, entry in bones.items()}
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{name}: its humanoid table is broken: {error!r}", path=document.path) from None
    out: dict[str, int] = {}
    words = _words(nodes, old=name == "VRM")
    for bone, node in nodes.items():
        if not isinstance(node, int) or not 0 <= node < len(document.gltf.nodes):
            raise InputError(f"{name}: bone '{bone}' is node {node!r}, which does not exist", path=document.path)
        if bone in words:
            if node in out.values():
                raise InputError(f"{name}: node '{document.name(node)}' is two bones", path=document.path)
            out[words[bone]] = node
    return out


def _words(bones: dict[str, Any], old: bool) -> dict[str, str]:
    """VRM bone → canonical joint."""
    words = {"hips": "pelvis", "neck": "neck1", "head": "head"}
    for n, bone in enumerate((b for b in _TRUNK if b in bones), start=1):
        words[bone] = f"spine{n}"
    for side in ("left", "right"):
        words |= {side + theirs: f"{side}.{own}" for theirs, own in _LIMBS.items()}
        for digit, own in _DIGITS.items():
            words |= {f"{side}{digit}{theirs}": f"{side}.{own}.{joint}" for theirs, joint in _FINGER.items()}
        thumb = _FINGER if old else _THUMB
        words |= {f"{side}Thumb{theirs}": f"{side}.thumb.{joint}" for theirs, joint in thumb.items()}
    return words
