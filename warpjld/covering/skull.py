"""Additional lines of the head's domain: a skull turns rigidly, and reaches further than its one segment.

The head's segment, from the head joint to the crown, tells neither how far the head extends forward and down nor that
it does not bend: a jaw lies nearer to the neck's segments than to the head's, and near a joint a vertex would turn by
half (C22). So the head's fan also heats the surface from lines to the face, the ears and the back of the head, and is
stiff: its domain turns rigidly with the bone, and is blended with the neck's at the border.
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

_FACE = 0.75  # length of the lines relative to the distance of the skin, since bone ends below it
_RISE = 0.5  # upward slope of the lines to ears and back, which keeps them above the neck
_REACH = 6.0  # in units of the crown's height: hits further away do not belong to the head


def skull_lines(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Lines inside a body's head in addition to its segment, as pairs of ends [m]; none where the skeleton has no head.

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
    directions = unit(np.array([-forward, left, -left]) + _RISE * up)
    reach = first_hits(vertices, nearby(vertices, faces, base, _REACH * height), np.tile(base, (3, 1)), directions)
    ends += [base + length * way for length, way in zip(reach, directions, strict=True) if length < _REACH * height]
    return [(base, base + _FACE * (end - base)) for end in ends]
