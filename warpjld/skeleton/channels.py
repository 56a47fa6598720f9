"""Angle channels of a joint, and the rotation of its bone that they define."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import about, multiply, rotate

__all__ = ["ABDUCTION", "CHANNELS", "FLEXION", "PIVOT", "TWISTING", "channel_rotations"]

CHANNELS = ("flexion", "pivot", "twisting", "abduction")
"""Angles of a joint, in the order of their last array axis. Abduction is this project's addition: the paper's
pivot turns the flexion axis about the segment (R27) and so moves nothing while the joint is straight."""

FLEXION, PIVOT, TWISTING, ABDUCTION = range(len(CHANNELS))
"""Indices of the channels."""


def channel_rotations(
    angles: NDArray[np.float64],
    axes: NDArray[np.float64],
    directions: NDArray[np.float64],
    mirror: NDArray[np.float64],
    normals: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Rotations of K bones from their joints' angles, quaternions x, y, z, w in the axes of ``directions``, (…, K, 4).

    Args:
        angles: [rad], shape (…, K, 4), channels as in ``CHANNELS``.
        axes: Unit flexion axes, shape (K, 3).
        directions: Unit directions of the bones, shape (K, 3).
        mirror: -1 for the left side, else 1, shape (K, 1).
        normals: directions × axes, shape (K, 3); computed if left out.
    """
    normals = np.cross(directions, axes) if normals is None else normals
    flexion, pivot, twisting, abduction = (angles[..., k, None] for k in range(len(CHANNELS)))
    pivoted = rotate(about(mirror * pivot * directions), axes)
    local = multiply(about(mirror * abduction * normals), about(flexion * pivoted))
    return np.asarray(multiply(local, about(-mirror * twisting * directions)))
