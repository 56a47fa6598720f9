"""The skull: a head is bone all over, and turns as a whole.

Its one segment, from where the head turns to its crown, says neither how far the head reaches forward and down nor that
nothing of it rounds: a jaw lies nearer to the neck's segments than to its own, and beside a joint a vertex would turn
by half (C22). So the head's fan also holds what lies about lines to the face, the ears and the back of the head, and is
stiff: inside it all turns with the bone, and the neck takes over where domains blend.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.actor import body_facing, face_points
from warpjld.skeleton.recognise.section import first_hits, nearby
from warpjld.skeleton.tree import Skeleton

__all__ = ["CROWN", "skull_lines"]

CROWN = "head.top"
"""The joint at which the skull's segment ends."""

_FACE = (
    0.75  # of the way from where the head turns to nose, chin, ears and the back of the head: bone ends below the skin
)
_RISE = 0.5  # slope of the lines to ears and back: below them a neck begins
_REACH = 6.0  # crowns' heights: what lies further off is no head


def skull_lines(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Lines inside a body's head besides its segment, as pairs of ends [m]; none where the skeleton has no head.

    Args:
        skeleton: The rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
    """
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    up, forward = body_facing(joints)
    if CROWN not in joints or up is None or forward is None:
        return []
    base = joints["head"]
    ends = list(dict(face_points(joints, vertices, up, forward)).values())
    height = float(np.linalg.norm(joints[CROWN] - base))
    left = np.cross(up, forward)
    ways = unit(np.array([-forward, left, -left]) + _RISE * up)
    reach = first_hits(vertices, nearby(vertices, faces, base, _REACH * height), np.tile(base, (3, 1)), ways)
    ends += [base + length * way for length, way in zip(reach, ways, strict=True) if length < _REACH * height]
    return [(base, base + _FACE * (end - base)) for end in ends]
