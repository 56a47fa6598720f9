"""Motion of an object that rides along with a closing hand: a viscous medium resists it, and nothing holds it (R123).

An object that is held at its place while digits close is held by more than its weight: digits seldom meet it at the
same time with the same force. Once let go, it has to move by millimetres to where the digits balance, which Newton's
method does not follow. Here it is never held. A step solves

    f(u) − D (u − u₀) = 0                                                                                  (1)

with the sum f of all forces, the displacement u₀ at the start of the step, and a drag D on the object's nodes in
proportion to their masses: a backward Euler step of the overdamped motion D u̇ = f (pseudo-transient continuation:
Kelley and Keyes 1998, SIAM J. Numer. Anal. 35, 508–523). Once nothing moves no drag is left, so that what comes to
rest is an equilibrium. D becomes less in proportion to what is left to balance (switched evolution relaxation), and
more where steps fail.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Prescribed
from warpjld.fem.contact import ContactSolution
from warpjld.fem.hand.blend import Moves
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.solve.branch import solve_branch

__all__ = ["Ride", "RideStep"]

_NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))
"""No Dirichlet conditions."""
_SLOWEST, _BEGINS = 0.05, 2.0
"""Way in a step, over the object's height, to which the drag limits an object that nothing but it bears; and first drag
after something changes, over that one."""
_STIFFER, _SOFTER, _TRIES = 4.0, 0.4, 4
"""Factors on the drag after a step that fails, and after one of few solves; and attempts at a step."""
_FEW, _MOST = 10, 20
"""Linear solves of a step from which on the drag is not reduced, and with which an attempt ends."""
_ROUGH, _EXACT, _PART = 1e-2, 1e-4, 0.1
"""Largest and smallest residual of a step with drag, over the forces in balance, and residual over that at its start:
such states are only passed through. Equilibria have the smallest. Steps take 4 to 6 linear solves, not 6 to 10."""


@dataclass(frozen=True, eq=False)
class RideStep:
    """A step of the motion.

    Attributes:
        solution: The state at its end.
        left: Sum of the drag on the nodes, what has still to be balanced [N].
        drag: Drag of the whole object in this step [N/m].
    """

    solution: ContactSolution
    left: float
    drag: float


class Ride:
    """Steps of an object's motion.

    Args:
        model: The contact model.
        history: History at the start.
        name: Name of the object.
        height: Its extent along gravity [m].
        budget: Linear solves that may be taken.

    Attributes:
        weight: Weight of the object [N].
        budget: Linear solves that may be taken.
        failed: Attempts at steps that failed since something began to change.
        least: Drag with which the object's weight alone moves it by a twentieth of its height in a step [N/m].
    """

    def __init__(
        self, model: ContactModel, history: History, name: str, height: float, budget: SearchBudget | None = None
    ) -> None:
        self._model, self._history, self._name, self.budget = model, history, name, budget or SearchBudget(None)
        self._bears = -model.pull(name)
        each = np.linalg.norm(self._bears, axis=1)
        self.weight = float(each.sum())
        self._share: NDArray[np.float64] = each / self.weight
        self.least = self.weight / (_SLOWEST * height)
        self._drag = self.least
        self._ahead, self.failed = np.inf, 0

    def begin(self, *, loaded: bool = False) -> None:
        """Resist more, as something is about to change: the weight that the hand bears (``loaded``), or its pose."""
        self._drag, self.failed = max(self._drag, _BEGINS * self.least), 0
        self._ahead = float(np.linalg.norm(self._bears)) if loaded else np.inf

    def step(
        self, after: ContactSolution, moves: tuple[str, Callable[[float], Moves]], borne: float = 0.0
    ) -> RideStep | None:
        """One step after a state; None if none of the attempts converges.

        Args:
            after: The state.
            moves: Name of the hand, and its bones' motion in the step (0 … 1).
            borne: Share of the weight borne by something else than the hand.
        """
        for _ in range(_TRIES):
            found = self._solved(after, moves, borne, self._drag)
            if found.converged:
                way = np.linalg.norm(found.last.displacement - after.last.displacement, axis=1)
                done = RideStep(found, self._drag * float(self._share @ way), self._drag)
                self._ahead = self._drag * float(np.linalg.norm(self._share * way))
                if found.spent <= _FEW:
                    enough = min(1.0, done.left / self.weight) * self.least
                    self._drag = max(_SOFTER * self._drag, enough)
                return done
            self._drag *= _STIFFER
            self.failed += 1
            if self.budget.exhausted:
                return None
        self._drag = _BEGINS * self.least
        return None

    def let_go(self, after: ContactSolution, moves: tuple[str, Callable[[float], Moves]]) -> ContactSolution:
        """Equilibrium under the whole weight without the medium, after a state."""
        return self._solved(after, moves, 0.0, 0.0)

    def way(self, after: ContactSolution, since: ContactSolution) -> float:
        """Mean way of the object between two states [m]."""
        return float(self._share @ np.linalg.norm(after.last.displacement - since.last.displacement, axis=1))

    def _tolerance(self, after: ContactSolution) -> float:
        """Residual with which a step with drag ends, relative to the forces at its start."""
        pushed = float(np.linalg.norm(sum(touch.nodal for touch in after.last.touches))) if after.last.touches else 0.0
        return _ROUGH if self._ahead >= _ROUGH / _PART * pushed else max(_EXACT, _PART * self._ahead / pushed)

    def _solved(
        self, after: ContactSolution, moves: tuple[str, Callable[[float], Moves]], borne: float, drag: float
    ) -> ContactSolution:
        found = solve_branch(
            self._model,
            self._history,
            after,
            1,
            moves=moves,
            known=(self._name, lambda share: _NOTHING),
            nodal=(lambda share: borne * self._bears) if borne else None,
            drag=drag * self._share if drag else None,
            halvings=0 if drag else 1,
            solves=min(_MOST, self.budget.next),
            tolerance=self._tolerance(after) if drag else _EXACT,
        )
        return self.budget.counted(found)
