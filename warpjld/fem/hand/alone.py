"""Equilibria of a hand's flesh in a pose without contact: the forces of bent joints on their own (R118).

Reactions at the bones of a pressed hand balance two things: contact, and flesh that is strained because joints are
bent. Only the former is work of muscles. The latter is found by an equilibrium of the hand's own mesh without contact.

This equilibrium is approached as an untouched hand would approach it: from the nearest known pose, with the flesh
carried along by its bones, by way of poses in between if that is too far. From frame to frame Newton's method takes two
or three steps; and where skin could fold in either direction, it folds as without contact. The pressed shape is no
suitable start: without the object that presses it, heavily compressed flesh is unstable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.arrays import norm
from warpjld.fem.body import Body, Tangent
from warpjld.fem.contact.solver.damping import Damping
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.lagged_solver import LaggedSolver
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.hand.motion import halfway
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.skeleton.kinematics import Poses

__all__ = ["FleshAlone", "Untouched"]

_STEPS = 12
"""Largest number of Newton steps; if more are needed, a pose in between is a better start."""
_SHORTEST = 0.05  # share of the step below which the line search gives up
_HALVINGS = 6
"""Largest number of bisections of the path between two poses."""
_TOLERANCE = 1e-4
"""Largest residual, per reactions at the bones, or per removed contact forces if these are smaller."""
_ROUNDING = 1e-7
"""Residual, per removed contact forces, below which no step is made."""
_KEPT = 16  # number of poses whose equilibrium is kept


@dataclass(frozen=True, eq=False)
class Untouched:
    """Equilibrium of a hand without contact.

    Attributes:
        poses: A single pose.
        displacement: Displacement of the nodes [m], shape (N, 3).
        reactions: Reactions at the prescribed nodes [N], zero elsewhere, shape (N, 3).
    """

    poses: Poses
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]


class FleshAlone:
    """Equilibria without contact; recent ones are cached.

    Args:
        hand: The hand at rest.
        body: Its own mesh and laws.
        degrees: Prescribed degrees of freedom, shape (n,): of bones, and of nodes where flesh was cut off.
        rest: The pose without displacements.

    Attributes:
        body, degrees: As given.
    """

    def __init__(self, hand: FleshHand, body: Body, degrees: NDArray[np.int64], rest: Poses) -> None:
        self.body = body
        self._hand = hand
        self._start = hand.moves(rest)
        self.degrees = degrees
        self._free = Prescribed(degrees, np.zeros(len(degrees))).free(body.degrees)
        self._elastic = Elastic(body)
        self._solver = LaggedSolver(body, "float64")
        self._damping = Damping(body)
        nothing = np.zeros_like(body.mesh.nodes)
        self._known = [Untouched(rest, nothing, nothing)]

    def at(
        self,
        poses: Poses,
        displacement: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: NDArray[np.float64],
        loads: Loads | None = None,
    ) -> Untouched | None:
        """Equilibrium of the hand with given bones and without contact; None if none is found.

        Args:
            poses: A single pose.
            displacement: Displacement of an equilibrium with contact in that pose [m], shape (N, 3).
            reactions: Reactions at its prescribed nodes [N], shape (N, 3).
            contact: Contact forces on its nodes [N], shape (N, 3).
            loads: Other loads, which remain.

        Raises:
            InputError: Wrong shapes.
        """
        for name, array in (("displacement", displacement), ("reactions", reactions), ("contact", contact)):
            if array.shape != self.body.mesh.nodes.shape:
                raise InputError(f"{name}: want shape {self.body.mesh.nodes.shape}, got {array.shape}")
        bones = displacement.reshape(-1)[self.degrees]
        away = [float(np.abs(one.displacement.reshape(-1)[self.degrees] - bones).max()) for one in self._known]
        nearest = int(np.argmin(away))
        if away[nearest] == 0.0 and nearest > 0:
            return self._known[nearest]
        if contact.any():
            pushed = norm(contact.reshape(-1))
            found = self._in_steps(self._known[nearest], poses, bones, pushed, loads or Loads(), _HALVINGS)
        else:
            found = Untouched(poses, displacement, reactions)
        if found is not None:
            if len(self._known) > _KEPT:
                self._known.pop(1)  # the first, at rest, stays
            self._known.append(found)
        return found

    def _in_steps(
        self,
        before: Untouched,
        poses: Poses,
        bones: NDArray[np.float64],
        pushed: float,
        loads: Loads,
        halvings: int,
    ) -> Untouched | None:
        """Equilibrium reached from that of another pose, by way of poses in between if necessary."""
        found = self._newton(before, poses, bones, pushed, loads)
        if found is None and halvings > 0:
            between = halfway(self._hand, before.poses, poses)
            half = self._in_steps(before, between, self._prescribed_values(between), pushed, loads, halvings - 1)
            if half is not None:
                found = self._in_steps(half, poses, bones, pushed, loads, halvings - 1)
        return found

    def _moves(self, poses: Poses) -> Moves:
        """Rigid motions of the bones from rest."""
        return self._start.to(self._hand.moves(poses))

    def _prescribed_values(self, poses: Poses) -> NDArray[np.float64]:
        """Prescribed displacements in a pose, shape (n,)."""
        nodes = self.degrees[::3] // 3
        x = self.body.mesh.nodes[nodes]
        return (self._moves(poses).blended(self._hand.weights[nodes], x) - x).reshape(-1)

    def _newton(
        self, before: Untouched, poses: Poses, bones: NDArray[np.float64], pushed: float, loads: Loads
    ) -> Untouched | None:
        """Equilibrium of a pose by Newton's method from that of another; None if it does not converge."""
        elastic, free, damping = self._elastic, self._free, self._damping
        u = self._hand.guess(self._moves(before.poses), self._moves(poses), before.displacement).reshape(-1)
        u[self.degrees] = bones
        if not elastic.upright(u):
            return None
        # pressures of the previous equilibrium, since the guess compresses single elements
        pressures = elastic.pressures(before.displacement.reshape(-1))
        self._solver.begin()
        damping.begin()
        for _ in range(_STEPS):
            forces, external = elastic.forces(u).forces, elastic.external(loads, u)
            residual = np.where(free, external - forces, 0.0)
            balance = np.where(free, 0.0, forces - external)
            if norm(residual) <= max(_TOLERANCE * min(pushed, norm(balance)), _ROUNDING * pushed):
                return Untouched(poses, u.reshape(-1, 3), balance.reshape(-1, 3))
            move = self._move(elastic.at(u, pressures, loads), residual)
            if move is None:
                return None
            length = 1.0
            while not elastic.upright(u + length * move):
                length *= 0.5
                if length < _SHORTEST:
                    return None
            damping.judge(length)
            pressures = elastic.pressures(u, length * move)
            u = u + length * move
        return None

    def _move(self, tangent: Tangent, residual: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """A Newton step (3N,), damped as far as needed; None if that fails."""
        stiffness, damping = tangent.stiffness, self._damping
        assert stiffness is not None
        done = damping.until_definite(lambda: self._solver.solve(damping.lend(stiffness), self._free, residual))
        return done.x if done.status is SolveStatus.CONVERGED else None
