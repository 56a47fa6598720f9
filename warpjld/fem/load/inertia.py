"""Inertia of the nodes in implicit Euler steps, with lumped masses (elastodynamics).

With nodal masses m, displacement u and velocity v at the start of a step of length Δt::

    u⁺ = u + Δt v⁺,   m (v⁺ − v) / Δt = f(u⁺)      hence   f(u⁺) − m (u⁺ − u − Δt v) / Δt² = 0

for the sum f of all other forces. Contact, friction and bonds in f therefore take effect as in a static problem with
additional nodal stiffness m/Δt² and load m (u + Δt v)/Δt². Internal forces have no resultant, so that the impulse of
contact and loads is the change of momentum exactly. Energy does not grow for convex energies (Hairer & Wanner 1996,
Solving Ordinary Differential Equations II, IV.12: the method is B-stable); a motion of frequency ω loses the fraction
1 − 1/(1 + ω² Δt²) of its energy in a step, so that waves have to be resolved in time.

The masses are row sums of the consistent mass matrix, distributed as weight is: what falls freely does not deform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, norm
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.load.loads import Loads, external_forces

__all__ = ["Dynamics", "Inertia", "lumped_masses"]


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Motion at the start of a solve with inertia.

    Attributes:
        velocity: Velocities of the nodes [m/s], shape (N, 3).
        second: Length of the unit of time [s].
    """

    velocity: Array
    second: float = 1.0

    def checked(self, body: Body) -> Dynamics:
        """Itself.

        Raises:
            InputError: Velocities that are not finite or of another shape, no length of the unit of time, or a body
                with elements without mass.
        """
        shape = body.mesh.nodes.shape
        if np.shape(self.velocity) != shape or not np.isfinite(self.velocity).all():
            raise InputError(f"dynamics: want finite velocities of shape {shape}, got {np.shape(self.velocity)}")
        if not 0.0 < self.second < np.inf:
            raise InputError(f"dynamics: want a unit of time above 0 s, got {self.second}")
        if not (body.density > 0.0).all():
            raise InputError("dynamics: want a density above 0 for every element")
        return self


@dataclass(frozen=True, eq=False)
class Inertia:
    """Inertial forces in one implicit Euler step.

    Attributes:
        masses: Masses of the nodes [kg], shape (N,).
        since: Displacement at the start of the step [m], shape (3N,).
        velocity: Velocity there [m/s], shape (3N,).
        length: Length of the step [s].
    """

    masses: Array
    since: Array
    velocity: Array
    length: float

    @property
    def coasted(self) -> Array:
        """Displacement at the end of the step without any force [m], shape (3N,)."""
        return self.since + self.length * self.velocity

    def force(self, u: Array) -> Array:
        """Inertial forces at displacement u (3N,) [N], shape (3N,)."""
        return -np.repeat(self.masses, 3) * (u - self.coasted) / self.length**2

    def rounding(self, u: Array) -> float:
        """Norm of mass over the squared step times displacement, to which rounding of the forces is relative [N]."""
        return norm(np.repeat(self.masses, 3) * (np.abs(u) + np.abs(self.coasted))) / self.length**2

    def added_to(self, matrix: BlockMatrix) -> BlockMatrix:
        """A matrix with m/Δt² added."""
        return matrix.with_diagonal(self.masses / self.length**2)

    def velocity_at(self, u: Array) -> Array:
        """Velocity at the end of the step, where the displacement is u (3N,) [m/s], shape (3N,)."""
        return (u - self.since) / self.length


def lumped_masses(body: Body) -> Array:
    """Masses of the nodes [kg], shape (N,)."""
    return external_forces(body, Loads(gravity=(1.0, 0.0, 0.0))).reshape(-1, 3)[:, 0]
