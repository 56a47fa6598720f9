"""Pattern of a product of three sparse matrices, its rows divided between threads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Ints32
from warpjld.fem.launch import grouped, on_rows, shared

__all__ = ["ProductPattern", "product_pattern"]

_LEAST_ROWS = 64
"""Rows below which one thread does all."""

Rows = tuple[Ints32, Ints32]
"""A pattern: where each row begins, and its columns."""


@dataclass(frozen=True, eq=False)
class ProductPattern:
    """Rows of a product, n columns wide.

    Attributes:
        rows: Where each of R rows begins, shape (R + 1,).
        columns: Ascending in each row.
        ranges: Rows with like work, for ``parts`` threads, shape (parts + 1,).
        marker: Scratch of as many ranges, shape (parts, n).
    """

    rows: Ints32
    columns: Ints32
    ranges: Ints32
    marker: Ints32


def product_pattern(first: Rows, second: Rows, third: Rows, width: int, *, threads: int) -> ProductPattern:
    """Where first · second · third, ``width`` columns wide, may differ from zero."""
    from warpjld_kernels import fem_pattern

    count = len(first[0]) - 1
    parts = threads if count >= _LEAST_ROWS else 1
    ranges = np.searchsorted(first[0], np.linspace(0, first[0][-1], parts + 1)).astype(np.int32)
    ranges[0], ranges[-1] = 0, count
    factors = [grouped(fem_pattern.Rows, rows=rows, columns=columns) for rows, columns in (first, second, third)]
    marker = np.full((parts, width), -1, np.int32)
    rows, columns = np.zeros(count + 1, np.int32), np.zeros(1, np.int32)
    for fill in (False, True):
        product = grouped(fem_pattern.Rows, rows=rows, columns=columns)
        arguments = [shared(ranges), fill, *factors, shared(marker), product]
        on_rows(fem_pattern.product_pattern, parts, arguments, threads=threads, least=2)
        if not fill:
            np.cumsum(rows, out=rows)
            columns = np.empty(rows[-1], np.int32)
            marker.fill(-1)
    return ProductPattern(rows, columns, ranges, marker)
