"""What a pose may differ by from what it was, and still not be worse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["TOLERANCES", "Tolerances"]


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of one pose.

    Attributes:
        volume: Growth of the volume error, of the whole; and
        region: of what the pose moves, that do not count.
        volume_free: Error of the whole, and
        region_free: of what the pose moves, up to which it may grow at will.
        folds: Faces that fold, as a factor and
        folds_more: as a number.
        roughness: As a factor, and
        roughness_more: RMS of dihedral angles [rad].
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
