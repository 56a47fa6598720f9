"""Validation of the arrays of a stored binding; kernels index memory with them without bounds checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.runs import Columns, Runs
from warpjld.skeleton.tree import Skeleton

__all__ = ["check_anchors", "check_array", "check_runs", "check_sparse"]

_LANES = 32  # vertices that one thread computes at once, see ``warpjld_kernels.covering_runs``


def check_runs(runs: Runs, skeleton: Skeleton, anchors: Anchors, vertices: int) -> None:
    """Check that every index of packed runs lies within its array.

    Raises:
        ValueError: An index is out of range, or an array has another shape or type.
    """
    columns = Columns(len(skeleton), len(anchors.ends), len(anchors.pairs))
    if runs.columns != columns:
        raise ValueError(f"its palette is {runs.columns}, not {columns}")
    check_array("order", runs.order, (None,), np.int32, within=(0, vertices))
    check_array("slots", runs.slots, (None,), np.int32)
    check_array("coefficients", runs.coefficients, (None,), np.float32)
    check_array("runs", runs.runs, (None, 8), np.int32)
    check_array("tiles", runs.tiles, (None, 2), np.int32)
    first, length, coefficient, slot, *kinds = runs.runs.astype(np.int64).T
    counts = np.stack(kinds, axis=1)
    if (runs.runs < 0).any() or (length < _LANES).any() or (np.cumsum(length) - length != first).any():
        raise ValueError("runs are not contiguous")
    if int(length.sum()) != len(runs.order) or len(np.unique(runs.order)) != vertices:
        raise ValueError("runs do not contain every vertex once")
    if ((coefficient + length * (counts @ [1, 1, 1, 3] + 3)) > len(runs.coefficients)).any():
        raise ValueError("a run reads beyond its coefficients")
    if ((slot + counts.sum(axis=1)) > len(runs.slots)).any():
        raise ValueError("a run reads beyond its slots")
    run, lane = runs.tiles.astype(np.int64).T
    if (run < 0).any() or (run >= len(length)).any() or (lane < 0).any() or (lane + _LANES > length[run]).any():
        raise ValueError("a tile lies outside its run")
    for start, many in zip(slot.tolist(), counts.tolist(), strict=True):
        _check_slots(runs.slots[start : start + sum(many)], many, columns)


def _check_slots(slots: NDArray[np.int32], counts: list[int], columns: Columns) -> None:
    """Check the slots of a run: positions, rotations, scales and muscles, of 3, 4, 1 and 1 palette columns each."""
    begin = 0
    for count, first, end, width in zip(counts, columns.kinds[:-1], columns.kinds[1:], (3, 4, 1, 1), strict=True):
        of_kind = slots[begin : begin + count]
        if len(of_kind) and not first <= of_kind.min() <= of_kind.max() <= end - width:
            raise ValueError("a slot is not a palette column of its kind")
        begin += count


def check_anchors(anchors: Anchors, skeleton: Skeleton) -> None:
    """Check that the anchors of the vertices refer to joints, segments and segment pairs that exist.

    Raises:
        ValueError: An index is out of range, or an array has another shape or type.
    """
    count, segments, pairs = len(anchors.rest), len(anchors.ends), len(anchors.pairs)
    joints = (0, len(skeleton))
    check_array("ends", anchors.ends, (None, 2), np.int32, within=joints)
    check_array("pairs", anchors.pairs, (None, 2), np.int32, within=(0, segments))
    for name in ("muscle", "stiff"):
        check_array(name, getattr(anchors, name), (segments,), np.bool_)
    wide = anchors.segment.shape[1:] if anchors.segment.ndim == 2 else (0,)
    check_array("segment", anchors.segment, (count, *wide), np.int32, within=(0, segments))
    for name in ("weight", "ratio", "side"):
        check_array(name, getattr(anchors, name), (count, *wide), np.float64)
    check_array("pair", anchors.pair, (count, 2), np.int32, within=(0, max(pairs, 2)))  # 0 and 1 where there is none
    check_array("between", anchors.between, (count, 2), np.float64)
    check_array("station", anchors.station, (count, 2), np.float64)
    if anchors.station.size and not 0.0 <= anchors.station.min() <= anchors.station.max() <= STATIONS - 1:
        raise ValueError(f"station: want values from 0 to {STATIONS - 1}")
    check_array("rigid", anchors.rigid, (count,), np.int32, within=(-1, len(skeleton)))


def check_sparse(name: str, parts: Mapping[str, NDArray[Any]], shape: tuple[int, int]) -> None:
    """Check that arrays form a valid sparse matrix (CSR) of the given shape.

    Raises:
        ValueError: They do not.
    """
    check_array(f"{name}.shape", parts["shape"], (2,), np.int64)
    if tuple(parts["shape"].tolist()) != shape:
        raise ValueError(f"{name}: want shape {shape}, got {tuple(parts['shape'].tolist())}")
    entries = parts["data"].shape
    check_array(f"{name}.data", parts["data"], (None,), np.float64)
    for part, want, within in (("indices", entries, (0, shape[1])), ("indptr", (shape[0] + 1,), (0, entries[0] + 1))):
        if parts[part].dtype not in (np.int32, np.int64):
            raise ValueError(f"{name}.{part}: want int32 or int64, got {parts[part].dtype}")
        check_array(f"{name}.{part}", parts[part], want, parts[part].dtype, within=within)
    rows = parts["indptr"]
    if rows[0] != 0 or rows[-1] != entries[0] or (np.diff(rows) < 0).any():
        raise ValueError(f"{name}: row pointers are not ascending from 0 to the number of entries")


def check_array(
    name: str,
    array: NDArray[Any],
    shape: tuple[int | None, ...],
    kind: Any,
    *,
    within: tuple[int, int] | None = None,
) -> None:
    """Check the dtype, shape (None: any length), finiteness and range of an array.

    Args:
        name: Name of the array, for messages.
        array: The array.
        shape: Expected shape, None for an axis of any length.
        kind: Expected dtype.
        within: Lowest value, and one more than the highest value.

    Raises:
        ValueError: One of them does not match.
    """
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    if array.dtype != np.dtype(kind) or not fits:
        raise ValueError(f"{name}: want {np.dtype(kind)} of shape {shape}, got {array.dtype} of shape {array.shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name}: not finite")
    if within is not None and array.size and not within[0] <= array.min() <= array.max() < within[1]:
        raise ValueError(f"{name}: an index outside {within[0]} to {within[1] - 1}")
