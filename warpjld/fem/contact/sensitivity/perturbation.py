"""What an equilibrium is differentiated by: prescribed displacements, an obstacle's place, moduli, friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from warpjld.fem.arrays import Array

__all__ = ["ObstacleTwist", "Perturbation"]


@dataclass(frozen=True, eq=False)
class ObstacleTwist:
    """An infinitesimal rigid motion x → x + shift + turn × (x − about), at the end of the step alone.

    Attributes:
        shift: Per unit of the parameter [m], shape (3,).
        turn: Rotation vector per unit of the parameter [rad], shape (3,).
        about: [m], shape (3,).
    """

    shift: Array
    turn: Array = field(default_factory=lambda: np.zeros(3))
    about: Array = field(default_factory=lambda: np.zeros(3))

    def at(self, points: Array) -> Array:
        """How points (n, 3) [m] move, shape (n, 3)."""
        return np.asarray(self.shift + np.cross(self.turn, points - self.about))


@dataclass(frozen=True, eq=False)
class Perturbation:
    """One parameter θ, by what it changes per unit at the end of the last load step.

    Attributes:
        prescribed: Prescribed displacements [m], shape (3N,), zero at what is free; None: none.
        obstacles: Pairs' obstacles that move, by the pairs' numbers.
        friction: Change of Coulomb's μ, by the pairs' numbers.
        stiffness: Change of each element's moduli, as a share of them, shape (E,); None: none.
    """

    prescribed: Array | None = None
    obstacles: Mapping[int, ObstacleTwist] = field(default_factory=dict)
    friction: Mapping[int, float] = field(default_factory=dict)
    stiffness: Array | None = None
