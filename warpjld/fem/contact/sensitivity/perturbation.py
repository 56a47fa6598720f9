"""Perturbations of a contact equilibrium: prescribed displacements, obstacle motion, moduli, friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from warpjld.fem.arrays import Array

__all__ = ["ObstacleTwist", "Perturbation"]


@dataclass(frozen=True, eq=False)
class ObstacleTwist:
    """Infinitesimal rigid motion x → x + shift + turn × (x − about) of an obstacle at the end of the step.

    Attributes:
        shift: Translation per unit of the parameter [m], shape (3,).
        turn: Rotation vector per unit of the parameter [rad], shape (3,).
        about: Centre of rotation [m], shape (3,).
    """

    shift: Array
    turn: Array = field(default_factory=lambda: np.zeros(3))
    about: Array = field(default_factory=lambda: np.zeros(3))

    def at(self, points: Array) -> Array:
        """Displacements of points (n, 3) [m] per unit of the parameter, shape (n, 3)."""
        return np.asarray(self.shift + np.cross(self.turn, points - self.about))


@dataclass(frozen=True, eq=False)
class Perturbation:
    """Changes of the equations at the end of the last load step per unit of a parameter θ.

    Attributes:
        prescribed: Change of the prescribed displacements [m], shape (3N,), zero at free degrees of freedom; None:
            none.
        obstacles: Motion of obstacles, by index of the pair.
        friction: Change of Coulomb's μ, by index of the pair.
        stiffness: Relative change of each element's moduli, shape (E,); None: none.
    """

    prescribed: Array | None = None
    obstacles: Mapping[int, ObstacleTwist] = field(default_factory=dict)
    friction: Mapping[int, float] = field(default_factory=dict)
    stiffness: Array | None = None
