"""Baked skin weights and corrective shapes that replace a rig's own in exported files."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["BakedSkin"]


@dataclass(frozen=True, eq=False)
class BakedSkin:
    """Skin weights over the N joints of a rig's file, and K corrective shapes applied before skinning.

    Attributes:
        joints: Joints of every welded vertex, shape (V, 4 k).
        weights: Their weights, rows summing to one, shape (V, 4 k).
        names: Names of the shapes.
        shapes: Displacements of the welded vertices at rest [m], shape (K, V, 3).
        at_rest: Weights of the shapes without animation, shape (K,).
        over_time: Weights of the shapes at the frames of the motion, shape (F, K).
    """

    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    names: tuple[str, ...] = ()
    shapes: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 3)))
    at_rest: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    over_time: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
