"""Linear programs of seven equations by a kernel, solved together; HiGHS takes tens of times as long for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["NO_SOLUTION", "largest_last"]

NO_SOLUTION = -1.0
"""Result of a program without a solution."""

_NOTHING = 1e-13  # rounding of a variable that is 0, where all numbers of a program are about 1
_NEGATIVE = 1e-9  # variables of a basic solution below 0 by no more than this are rounding


def largest_last(programs: Sequence[NDArray[np.float64]]) -> list[float | None]:
    """Largest last variable of each program: Σ x_j a_j = (0, 0, 0, 0, 0, 0, 1), x ≥ 0, a_j the columns of (7, n).

    The value is that of the optimal basis, found by ``warpjld_kernels.small_programs`` and solved in float64;
    ``NO_SOLUTION`` where there is none; None where the kernel did not find it, and another solver has to.
    """
    import warp as wp
    from warpjld_kernels.small_programs import ROWS, solve_programs

    if not programs:
        return []
    counts = [own.shape[1] for own in programs]
    basis = np.zeros((len(programs), ROWS), dtype=np.int32)
    status = np.zeros(len(programs), dtype=np.int32)
    arrays = (
        (np.concatenate([own.T.ravel() for own in programs]), wp.float64),
        (np.cumsum([0, *counts]).astype(np.int32), wp.int32),
        (np.empty((len(programs), ROWS * (max(counts) + 1))), wp.float64),
        (basis, wp.int32),
        (status, wp.int32),
    )
    given = [wp.array(a, dtype=kind, device="cpu", copy=False) for a, kind in arrays]
    wp.launch(solve_programs, len(programs), inputs=given[:3], outputs=given[3:], device="cpu")
    return [
        NO_SOLUTION if ended == 0 else _of_basis(own, columns) if ended > 0 else None
        for own, columns, ended in zip(programs, basis, status, strict=True)
    ]


def _of_basis(program: NDArray[np.float64], basis: NDArray[np.int32]) -> float | None:
    """The last variable in the basic solution; None where that is not feasible."""
    try:
        values = np.linalg.solve(program[:, basis], np.r_[np.zeros(6), 1.0])
    except np.linalg.LinAlgError:
        return None
    most = float(values[basis == program.shape[1] - 1].sum())
    if most <= _NOTHING:  # no solution has more than this one, by duality, even if it is not feasible
        return 0.0
    return None if values.min() < -_NEGATIVE else most
