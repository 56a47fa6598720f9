"""Results of a static solve: equilibria and status."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.errors import WarpjldError
from warpjld.fem.arrays import Array, Ints
from warpjld.fem.load.loads import Loads
from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["Instant", "Solution", "SolveError"]


@dataclass(frozen=True, eq=False)
class Instant:
    """Equilibrium at one load instant (R99).

    Attributes:
        factor: Share of the loads and prescribed displacements, 1 at the end.
        displacement: U [m], shape (N, 3).
        reactions: Reactions at prescribed degrees of freedom [N], zero elsewhere, shape (N, 3) (B eq. 8).
        newton: Number of Newton iterations (1 for a linear solve).
        iterations: Total number of iterations of the linear solver.
        residual: True residual |R − K U| over |R| of the free degrees of freedom, float64.
    """

    factor: float
    displacement: Array
    reactions: Array
    newton: int
    iterations: int
    residual: float

    def __repr__(self) -> str:
        summary = f"{self.newton} Newton iterations, residual {self.residual:.1e}"
        return f"Instant(load {self.factor:.3f}, {len(self.displacement)} nodes, {summary})"


@dataclass(frozen=True, eq=False)
class Solution:
    """Equilibria found by a static solve.

    Attributes:
        status: How the solve ended.
        instants: Every equilibrium found, in order.
        message: How it ended, for the user.
        held: Degrees of freedom that were constrained because a body was free.
        loads: The loads at full strength.
    """

    status: SolveStatus
    instants: tuple[Instant, ...]
    message: str
    held: Ints
    loads: Loads

    def __repr__(self) -> str:
        return f"Solution({self.status.name}, {len(self.instants)} instants: {self.message})"

    @property
    def converged(self) -> bool:
        """Whether the full load was reached."""
        return self.status is SolveStatus.CONVERGED

    @property
    def last(self) -> Instant:
        """The last equilibrium."""
        return self.instants[-1]

    @property
    def displacement(self) -> Array:
        """U of the last equilibrium [m], shape (N, 3)."""
        return self.last.displacement

    @property
    def reactions(self) -> Array:
        """Reactions of the last equilibrium [N], shape (N, 3)."""
        return self.last.reactions


class SolveError(WarpjldError):
    """A solve did not reach the full load; ``solution`` holds the equilibria found."""

    def __init__(self, solution: Solution) -> None:
        self.solution = solution
        super().__init__(solution.message)
