"""Distance of points to line segments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["segment_distance"]


def segment_distance(
    points: NDArray[np.float64], joints: NDArray[np.float64], segments: Sequence[tuple[int, int]]
) -> NDArray[np.float64]:
    """Distance of points (V, 3) to the nearest of the segments between joints (J, 3) [m], shape (V,)."""
    best = np.full(len(points), np.inf)
    for a, b in segments:
        along = joints[b] - joints[a]
        square = max(float(along @ along), 1e-18)
        t = np.clip((points - joints[a]) @ along / square, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - joints[a] - t[:, None] * along, axis=1))
    return best
