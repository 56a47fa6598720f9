"""Iterations ("turns") of the paper's loop at one time: slave nodes are repelled, then released (B Fig. 9, R113)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array, Ints
from warpjld.fem.body import Body
from warpjld.fem.contact.paper.sides import Meeting, Side
from warpjld.fem.contact.results.contact_solution import ContactInstant, PairContact
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.fem.solver.solution import Solution
from warpjld.fem.solver.static import solve

__all__ = ["Turns"]

_TURNS = 60
"""Most turns at one time."""
_LEAST, _MOST = 0.1, 2.0
"""Bounds on the factor by which the relaxation changes in a turn."""
_RUNAWAY = 1e3
"""Motion in a turn over the smallest so far that counts as divergence."""


class Turns:
    """Repel–release iteration at one time.

    Attributes:
        last: Last equilibrium of the released bodies.
        forces: Contact forces on all nodes in that equilibrium [N], shape (N, 3).
        omega: Relaxation factor ω; 1 without relaxation.
        solves: Number of static solves, two per turn.
        moves: Largest motion or overlap of any point in each turn [m].
        report: How the iteration ended, in words.
        diverged: Whether it did not converge although every static solve did.
    """

    def __init__(
        self,
        body: Body,
        known: Prescribed,
        sides: list[Side],
        loads: Loads,
        time: float,
        forces: Array,
        omega: float | None,
        threshold: float,
    ) -> None:
        self._body, self._known, self._sides, self._loads, self._time = body, known, sides, loads, time
        self._aitken, self._threshold = omega is not None, threshold
        self._touches: list[PairContact] = []
        self._iterations = 0
        self.forces, self.omega = forces, 1.0 if omega is None else omega
        self.solves = 0
        self.moves: list[float] = []
        self.report = ""
        self.diverged = False

    def through(self, last: Solution, first: Array | None, deepest: float) -> SolveStatus:
        """Iterate to convergence; fails if bodies overlap by more than ``deepest`` [m] at first (step too long)."""
        rest, surface = self._body.mesh.nodes, _surface(self._sides)
        self.last = self._solve(self._known, self._loaded(self.forces), last, first)
        if not self.last.converged:
            return self._ended(self.last.status, f"the bodies do not follow what is prescribed: {self.last.message}")
        before = np.zeros(0)
        for turn in range(_TURNS):
            u = self.last.displacement
            meetings = [side.meet(rest + u, rest + u, self._time) for side in self._sides]
            overlap = max(float(np.maximum(-m.distance, 0.0).max(initial=0.0)) for m in meetings)
            if turn == 0 and overlap > deepest:
                return self._ended(SolveStatus.STAGNATED, f"bodies overlap by {1e3 * overlap:.3g} mm at once")
            fixed, found = self._repelled(surface, meetings)
            if not fixed.converged:
                return self._ended(fixed.status, f"repelled bodies found no equilibrium: {fixed.message}")
            off = (found - self.forces).ravel()
            if self._aitken and len(before) and (off != before).any():
                change = off - before
                aitken = -self.omega * float(before @ change) / float(change @ change)
                self.omega = float(np.clip(aitken, _LEAST * self.omega, min(_MOST * self.omega, 1.0)))
            before = off
            forces = self.forces + self.omega * off.reshape(-1, 3)
            # with nearly full forces the repelled configuration is almost in equilibrium already
            start = fixed if self.omega > 0.5 else self.last
            freed = self._solve(self._known, self._loaded(forces), start)
            if not freed.converged:
                return self._ended(
                    freed.status, f"released bodies have no equilibrium under these forces: {freed.message}"
                )
            self.last, self.forces = freed, forces
            self.solves += 2
            moved = float(np.abs(freed.displacement - u).max())
            # with relaxation, bodies move less than their distance from the solution
            self.moves.append(max(moved, self._repelled_by(fixed, u)))
            if self.moves[-1] < self._threshold:
                return self._ended(SolveStatus.CONVERGED, f"{turn + 1} turns")
            if self.moves[-1] > _RUNAWAY * min(self.moves):
                break
        self.diverged = True
        grows = self.growth
        how = f"each turn moves {grows:.2f} times as far as the one before"
        status = SolveStatus.STAGNATED if grows >= 1.0 else SolveStatus.MAX_ITERATIONS
        return self._ended(status, f"repelling and releasing did not settle in {len(self.moves)} turns: {how}")

    def _repelled_by(self, fixed: Solution, u: Array) -> float:
        """Largest distance by which active nodes were repelled [m]."""
        pushed = np.concatenate([side.slave.nodes[side.touching] for side in self._sides])
        return float(np.abs(fixed.displacement[pushed] - u[pushed]).max(initial=0.0))

    def _loaded(self, forces: Array) -> Loads:
        nodal = forces if self._loads.nodal is None else self._loads.nodal + forces
        return replace(self._loads, nodal=nodal)

    @property
    def growth(self) -> float:
        """Geometric mean of the ratio of successive moves over the last ten turns; below 1 the iteration converges."""
        moves = self.moves[-11:]
        return float((moves[-1] / moves[0]) ** (1.0 / (len(moves) - 1))) if len(moves) > 1 else np.nan

    def instant(self) -> ContactInstant:
        """The equilibrium reached."""
        found = self.last.last
        touches = tuple(self._touches)
        return ContactInstant(
            self._time, found.displacement, found.reactions, touches, self.solves, self._iterations, found.residual
        )

    def _repelled(self, surface: Ints, meetings: list[Meeting]) -> tuple[Solution, Array]:
        """Steps 2 to 4: solution with the master's surface fixed and slave nodes on it, and contact forces on all nodes
        [N], shape (N, 3)."""
        rest, u = self._body.mesh.nodes, self.last.displacement
        repelled = _without(_onto_skin(rest, surface, u[surface], self._sides, meetings), self._known)
        fixed = self._solve(self._known + repelled, self._loads, self.last)
        forces = np.zeros_like(rest)
        self._touches = []
        for side, meeting in zip(self._sides, meetings, strict=True):
            own = side.share(meeting, fixed.reactions[side.slave.nodes[meeting.rows]], forces)
            self._touches.append(side.touch(meeting, own, rest + fixed.displacement))
        return fixed, forces

    def _solve(self, known: Prescribed, loads: Loads, after: Solution, guess: Array | None = None) -> Solution:
        found = solve(self._body, known, loads, after=after, guess=guess, free="hold", check=False)
        self._iterations += found.last.iterations
        return found

    def _ended(self, status: SolveStatus, report: str) -> SolveStatus:
        self.report = report
        return status


def _surface(sides: list[Side]) -> Ints:
    """Nodes of all masters."""
    return np.unique(np.concatenate([side.nodes for side in sides])).astype(np.int64)


def _onto_skin(rest: Array, surface: Ints, skin: Array, sides: list[Side], meetings: list[Meeting]) -> Prescribed:
    """Dirichlet conditions: the master's surface at its displacement, slave nodes at their targets on it; for nodes of
    both, those of the master."""
    nodes = [surface]
    places = [skin]
    for side, meeting in zip(sides, meetings, strict=True):
        nodes.append(side.slave.nodes[meeting.rows].astype(np.int64))
        places.append(meeting.target - rest[nodes[-1]])
    found, first = np.unique(np.concatenate(nodes), return_index=True)
    values = np.concatenate(places)[first]
    return Prescribed((3 * found[:, None] + np.arange(3)).ravel(), values.ravel())


def _without(given: Prescribed, known: Prescribed) -> Prescribed:
    """``given`` without the degrees of freedom of ``known``."""
    keep = ~np.isin(given.degrees, known.degrees)
    return Prescribed(given.degrees[keep], given.values[keep])
