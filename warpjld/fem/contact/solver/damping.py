"""Levenberg–Marquardt damping of Newton steps, in the metric of the stiffness at rest.

Where flesh folds in a crease, its tangent is nearly singular or not positive definite on the way. A fraction of the
stiffness at rest is then added to the matrix, but not to the forces: it restrains deformation without resistance and
hardly any rigid motion, and does not change the solution (Levenberg 1944, Marquardt 1963).
"""

from __future__ import annotations

from collections.abc import Callable

from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.solver.krylov import Iteration, SolveStatus

__all__ = ["Damping"]

_FIRST, _MORE, _MOST = 0.05, 4.0, 4.0
"""First damping (fraction of the stiffness at rest), factor by which it is raised, and largest value."""
_LESS = 3.0
"""Divisor by which it is reduced after a full step."""
_SHORT = 0.5
"""Step length below which it is raised."""


class Damping:
    """Fraction of the bodies' stiffness at rest that is added to their tangent.

    Args:
        body: All bodies, merged.

    Attributes:
        share: The fraction; 0 without damping.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self._rest: Array | None = None
        self.share = 0.0

    def begin(self) -> None:
        """Start a load step without damping."""
        self.share = 0.0

    def lend(self, stiffness: BlockMatrix) -> BlockMatrix:
        """The damped tangent; a new matrix if there is damping."""
        if self.share == 0.0:
            return stiffness
        if self._rest is None:
            rest = self._body.at().stiffness
            assert rest is not None
            self._rest = rest.values
        return BlockMatrix(stiffness.rows, stiffness.columns, stiffness.values + self.share * self._rest)

    def more(self) -> bool:
        """Raise the damping; False if it exceeds the largest value."""
        self.share = max(_FIRST, _MORE * self.share)
        return self.share <= _MOST

    def until_definite(self, attempt: Callable[[], Iteration]) -> Iteration:
        """Repeat a linear solve with more damping as long as its matrix is indefinite and the damping can be raised."""
        while True:
            done = attempt()
            if done.status is not SolveStatus.INDEFINITE or not self.more():
                return done

    def judge(self, length: float) -> None:
        """Adapt the damping to the length (0 … 1) of the last step: more after a short step, less after a full one."""
        if length < _SHORT:
            self.share = min(max(_FIRST, _MORE * self.share), _MOST)
        elif length == 1.0:
            self.share = self.share / _LESS if self.share > 0.2 * _FIRST else 0.0
