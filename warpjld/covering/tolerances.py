"""Tolerances by which the quality of a pose may decrease in calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["TOLERANCES", "Tolerances"]


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of one pose.

    Attributes:
        volume: Tolerated growth of the volume error, relative to the whole volume.
        region: The same, relative to the volume that the pose moves.
        volume_free: Volume error below which any growth is tolerated, relative to the whole volume.
        region_free: The same, relative to the volume that the pose moves.
        folds: Tolerated factor of the number of folded faces.
        folds_more: Tolerated number of folded faces in addition.
        roughness: Tolerated factor of the roughness (RMS growth of dihedral angles).
        roughness_more: Tolerated roughness in addition [rad].
    """

    volume: float = 0.001
    region: float = 0.01
    volume_free: float = 0.009
    region_free: float = 0.05
    folds: float = 1.01
    folds_more: int = 1
    roughness: float = 1.045
    roughness_more: float = float(np.radians(0.09))


TOLERANCES = Tolerances()
