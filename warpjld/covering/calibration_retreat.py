"""Backtracking of fitted amplitudes until no pose is worse than at the start, each no further than necessary."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.amplitudes import amplitudes_of, with_amplitudes
from warpjld.covering.calibration_guard import Guard, PoseMeasures, copy_of
from warpjld.covering.covering import Covering
from warpjld.covering.pose_losses import PoseLosses

__all__ = ["retreat"]

_ROUNDS = 2  # rounds after which amplitudes that make a pose worse go back to their start at once
_LEFT = (1.0, 0.4, 0.0)  # share of an amplitude's change that is kept, one level further each time it is responsible
_SHARE = 0.3  # effect relative to the strongest amplitude's in the same place, above which one is responsible


def retreat(
    covering: Covering,
    fitted: NDArray[np.float64],
    losses: PoseLosses,
    guard: Guard,
    report: Callable[[str, int, int], None],
) -> tuple[NDArray[np.float64], PoseMeasures, tuple[str, ...]]:
    """Move fitted amplitudes back towards those of a covering where poses got worse.

    Args:
        covering: The covering at the start.
        fitted: Fitted amplitudes, shape (2 J,).
        losses: Losses of the poses that ``guard`` measures.
        guard: Decides which poses are worse.
        report: Called with the name of the phase, its steps done, and the number of its steps.

    Returns:
        Amplitudes, measures of all poses with them, and the names of joints whose amplitudes were moved back.
    """
    start = amplitudes_of(covering.parameters)
    change = fitted - start
    fields = _amplitude_fields(covering)
    level = np.zeros(len(start), dtype=np.int64)
    measured = copy_of(guard.first)
    changed = change != 0.0
    for attempt in count():
        amplitudes = start + np.array(_LEFT)[level] * change
        other = covering.with_parameters(with_amplitudes(covering.parameters, amplitudes))
        again = np.array([f for f, p in enumerate(losses.of_pose) if p is not None and changed[p.parameters].any()])
        guard.measure(other, again.astype(np.int64), measured, lambda done, total: report("comparing", done, total))
        emptier, folded, rougher = guard.worse(measured)
        if not (emptier | folded | rougher).any():
            break
        before = level.copy()
        for f in np.flatnonzero(emptier | folded | rougher).tolist():
            part = losses.of_pose[f]
            if part is None:
                continue
            blame = np.zeros(len(start))
            if emptier[f]:
                wrong = part.volume_slope(amplitudes) * change[part.parameters] * np.sign(measured.volume[f])
                blame[part.parameters] += _relative(np.maximum(wrong, 0.0))
            weight = np.zeros(len(covering.surface.vertices))
            if folded[f]:
                weight[measured.folded[f]] = 1.0
            elif rougher[f]:
                more = np.maximum(measured.sharper[f] - guard.first.sharper[f], 0.0)
                for corner in guard.local_hinges(f).T:
                    weight += np.bincount(corner, more, minlength=len(weight))
            doing = np.zeros(len(start))
            doing[part.parameters] = np.abs((fields.T @ weight) * change)[part.parameters]
            blame += _relative(doing * (level < len(_LEFT) - 1))
            level[(blame >= _SHARE) & (level == before)] += 1 if attempt < _ROUNDS else len(_LEFT)
        level = np.minimum(level, len(_LEFT) - 1)
        changed = level != before
        if not changed.any():  # no single amplitude is responsible for the poses that are worse: reset all
            level[:] = len(_LEFT) - 1
            changed = np.ones(len(start), dtype=bool)
    joints = np.unique(np.flatnonzero(level) % len(covering.skeleton))
    return amplitudes, measured, tuple(covering.skeleton.names[j] for j in joints)


def _relative(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values / max(float(values.max(initial=0.0)), 1e-300)


def _amplitude_fields(covering: Covering) -> sp.csr_array:
    """Magnitude of each amplitude's field at each vertex, shape (V, 2 J)."""
    fields, begins = covering.fields, covering.anchors.ends[:, 0]
    joints = len(covering.skeleton)
    of_segment = sp.csr_array((np.ones(len(begins)), (np.arange(len(begins)), begins)), shape=(len(begins), joints))
    return sp.csr_array(sp.hstack([abs(fields.roundings), abs(fields.muscles) @ of_segment], format="csr"))
