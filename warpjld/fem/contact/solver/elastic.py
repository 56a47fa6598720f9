"""Forces and tangent stiffness of the bodies without contact, with buffers reused between evaluations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body, Tangent
from warpjld.fem.load.loads import Loads, external_forces, subtract_pressure_stiffness

__all__ = ["Elastic"]


class Elastic:
    """Internal forces, external forces and tangent of bodies; with linear laws the stiffness is assembled only once.

    Args:
        body: All bodies, merged.

    Attributes:
        body: As given.
        linear: Whether all laws are linear.
        stiffness: Mean diagonal stiffness of each node at rest [N/m], shape (N,).
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        self.linear = not body.large_strain
        self._rest = body.at()
        self._last: Tangent | None = None
        self._there: tuple[Array, Tangent] | None = None
        self._dead: tuple[Loads, Array] | None = None
        assert self._rest.stiffness is not None
        self.stiffness: Array = np.einsum("nii->n", self._rest.stiffness.diagonal()) / 3.0
        if not self.linear:
            self._last = self._rest

    def at(self, u: Array, pressures: Array | None, loads: Loads) -> Tangent:
        """Tangent stiffness, minus that of follower pressure, and internal forces at displacement u (3N,).

        ``pressures`` (E,) [Pa] replace the elements' own in the stiffness. The matrix is valid until the next call.
        """
        if self.linear:
            return self.forces(u)
        self._last = self.body.at(u, pressures=pressures, reuse=self._last)
        assert self._last.stiffness is not None
        subtract_pressure_stiffness(self._last.stiffness, self.body, loads, u)
        return self._last

    def forces(self, u: Array) -> Tangent:
        """Internal forces at displacement u (3N,); the last result is cached, as line searches repeat it."""
        if not self.linear:
            if self._there is None or not np.array_equal(u, self._there[0]):
                self._there = u.copy(), self.body.at(u, stiffness=False)
            return self._there[1]
        assert self._rest.stiffness is not None
        own = self._rest.stiffness.product(u, threads=self.body.threads)
        return replace(self._rest, forces=self._rest.forces + own)

    def external(self, loads: Loads, u: Array) -> Array:
        """Nodal forces of loads [N], shape (3N,); follower loads at displacement u with large strain."""
        if not self.linear and loads.follows:
            return external_forces(self.body, loads, u)
        if self._dead is None or self._dead[0] is not loads:
            self._dead = loads, external_forces(self.body, loads)
        return self._dead[1]

    def pressures(self, u: Array, move: Array | None = None) -> Array | None:
        """Pressure of each element [Pa], shape (E,), predicted after a move (3N,); None with linear laws."""
        return None if self.linear else self.body.at(u, stiffness=False, increment=move).pressures

    def upright(self, u: Array, least: Array | float = 0.0) -> bool:
        """Whether the elements' Jacobian determinants exceed ``least`` (E,) at displacement u (3N,); True with linear
        laws."""
        return self.linear or bool((self.forces(u).lowest > least).all())
