"""Bound on the linear solves of a grip search: a search that fails ends after the same trials on any machine."""

from __future__ import annotations

from warpjld.fem.contact import ContactSolution

__all__ = ["SearchBudget"]

_SEARCH = 450
"""Most linear solves of a search. The gentlest grip of a ball between thumb and index (3-mm flesh, five trials)
takes about 300; a solve of two digits of 6-mm elements takes a tenth of a second, so that a search that fails ends
within a minute."""
_TRIAL = 150
"""Most linear solves of one equilibrium after closing, so that others can be tried: found ones took 1 to 25."""


class SearchBudget:
    """Linear solves that a grip search may still take.

    Args:
        most: Most linear solves of the search; None: no bound but those of ``press``.
        trial: Most linear solves of one equilibrium.

    Attributes:
        spent: Linear solves so far.
    """

    def __init__(self, most: int | None = _SEARCH, trial: int = _TRIAL) -> None:
        self._most, self._trial = most, trial
        self.spent = 0

    @property
    def exhausted(self) -> bool:
        """Whether nothing is left."""
        return self.left == 0

    @property
    def left(self) -> int | None:
        """Linear solves that are left, ≥ 0; None without a bound."""
        return None if self._most is None else max(0, self._most - self.spent)

    @property
    def next(self) -> int:
        """Linear solves that the next equilibrium after closing may take, ≥ 0."""
        return self.trial(0)

    def trial(self, usual: int) -> int:
        """Linear solves that an equilibrium may take which usually takes up to ``usual`` of them, ≥ 0."""
        most = max(self._trial, usual)
        return most if self.left is None else min(most, self.left)

    def counted(self, solution: ContactSolution) -> ContactSolution:
        """The solution of an equilibrium, after its linear solves are counted."""
        self.spent += solution.spent
        return solution
