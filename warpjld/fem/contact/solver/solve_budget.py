"""Bound on the linear solves of a run, in whole and in vain: a run that finds nothing ends, on any machine alike."""

from __future__ import annotations

import math

from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["SolveBudget"]

_IN_VAIN = 600
"""Most linear solves of failed searches on the way to one requested time: above what a failure halved seven times in a
row was seen to take (562, fingers without friction side by side); steps that fail, succeed halved, and fail again would
otherwise go on without end."""


class SolveBudget:
    """Linear solves of a run so far, and how many are left.

    Args:
        most: Most linear solves of the run; None: no bound but that on solves in vain.

    Attributes:
        spent, iterations: Linear solves of the run, and their iterations.
        vain: Those of failed searches since the last requested time.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = math.inf if most is None else most
        self.spent = self.iterations = self.vain = 0
        self._before, self._failed = (0, 0), ""

    @property
    def left(self) -> float:
        """Linear solves that the next step may take."""
        return min(self._most - self.spent, _IN_VAIN - self.vain)

    def count(self, solves: int, iterations: int, status: SolveStatus) -> None:
        """Count the solves and iterations of a step, and how it ended."""
        self.spent += solves
        self.iterations += iterations
        if status is not SolveStatus.CONVERGED:
            self.vain += solves
            self._failed = self._failed if status is SolveStatus.EXHAUSTED else status.value

    def reached(self) -> tuple[int, int]:
        """Solves and iterations since the last requested time, which counts from now on."""
        since = self.spent - self._before[0], self.iterations - self._before[1]
        self._before, self.vain = (self.spent, self.iterations), 0
        return since

    def judged(self, status: SolveStatus, reason: str) -> tuple[SolveStatus, str]:
        """Status and reason of a failed step; ``EXHAUSTED`` if nothing is left to try another."""
        if self.left > 0:
            return status, reason
        tried = f"{self.vain} were spent in vain" if self.vain >= _IN_VAIN else f"{self.spent} were spent"
        reason = self._failed if status is SolveStatus.EXHAUSTED else reason
        why = f"; the last failure: {reason}" if reason else ""
        return SolveStatus.EXHAUSTED, f"{SolveStatus.EXHAUSTED.value}: {tried}{why}"
