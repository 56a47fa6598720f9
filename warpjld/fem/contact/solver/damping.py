"""Levenberg–Marquardt damping of Newton steps, in the metric of the stiffness at rest.

Flesh that folds in a crease has a tangent that is nearly singular there, or not positive definite, on the way to its
fold. A share of the stiffness at rest is then lent to the matrix, not to the forces: it holds back what deforms without
resistance and hardly what moves as a whole, and where the steps lead is not changed (Levenberg 1944, Marquardt 1963,
with the metric of the elements).
"""

from __future__ import annotations

from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body

__all__ = ["Damping"]

_FIRST, _MORE, _MOST = 0.05, 4.0, 4.0
_LESS = 3.0
_SHORT = 0.5
"""Steps shorter than this share were too long."""


class Damping:
    """The share of a body's stiffness at rest that is lent to its tangent.

    Args:
        body: All bodies, merged.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self._rest: Array | None = None
        self.share = 0.0

    def begin(self) -> None:
        """A new step: none is lent."""
        self.share = 0.0

    def lend(self, stiffness: BlockMatrix) -> BlockMatrix:
        """The tangent with what is lent to it, in a new matrix if there is any."""
        if self.share == 0.0:
            return stiffness
        if self._rest is None:
            rest = self._body.at().stiffness
            assert rest is not None
            self._rest = rest.values
        return BlockMatrix(stiffness.rows, stiffness.columns, stiffness.values + self.share * self._rest)

    def more(self) -> bool:
        """Lend more; False where that would no longer be help."""
        self.share = max(_FIRST, _MORE * self.share)
        return self.share <= _MOST

    def judge(self, length: float) -> None:
        """Lend more after a step of which only a short part (0 … 1) was gone, less after a whole one."""
        if length < _SHORT:
            self.share = min(max(_FIRST, _MORE * self.share), _MOST)
        elif length == 1.0:
            self.share = self.share / _LESS if self.share > 0.2 * _FIRST else 0.0
