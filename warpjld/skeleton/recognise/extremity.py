"""End point of a chain inside the flesh: the centre of the extremity (B §2.1, R13)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.section import cross_section, skin_hits

__all__ = ["find_extremity"]


def find_extremity(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    start: NDArray[np.float64],
    direction: NDArray[np.float64],
    expected: float,
) -> NDArray[np.float64] | None:
    """Centre of the rounded end that a last segment points to.

    The line along the segment is followed to where it leaves the surface; the centre lies one local radius (the pad's)
    before that, in the middle of the cross-section.

    Args:
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        start: The last joint [m].
        direction: Unit direction of its bone.
        expected: Plausible length of the segment [m]: surface met much further away belongs to something else.

    Returns:
        The point, or None where the line does not leave the surface within reach.
    """
    # if the line misses, take the furthest vertex near it: the last joint may be off-centre or its bone skewed
    length = skin_hits(vertices, faces, start[None], direction[None])[0]
    if not np.isfinite(length) or length > 3.0 * expected:
        near = vertices - start
        along = near @ direction
        aside = np.linalg.norm(near - along[:, None] * direction, axis=1)
        inside = (along > 0) & (along < 3.0 * expected) & (aside < 0.5 * expected)
        if not inside.any():
            return None
        length = float(along[inside].max())
    middle = cross_section(vertices, faces, start + 0.6 * length * direction, direction)
    radius = 0.35 * length if middle is None else middle.radius
    end = start + max(length - radius, 0.5 * length) * direction
    section = cross_section(vertices, faces, end, direction)
    if section is None or np.linalg.norm(section.centre - end) > radius:
        return end
    return section.centre
