"""Sparsity patterns of a mesh's stiffness matrix and of products of three sparse matrices."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Ints32
from warpjld.fem.launch import grouped, on_rows, shared, threads_of
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["Batches", "Pattern", "ProductPattern", "batches_of", "pattern_of", "triple_product"]

_LEAST_ROWS = 64
"""Number of rows below which a single thread is used."""

Rows = tuple[Ints32, Ints32]
"""A pattern: start of each row, and column indices."""


@dataclass(frozen=True, eq=False)
class ProductPattern:
    """Sparsity pattern of a product with n columns.

    Attributes:
        rows: Start of each of R rows, shape (R + 1,).
        columns: Column indices, ascending in each row.
        ranges: Bounds of ``parts`` ranges of rows with equal work, shape (parts + 1,).
        marker: Scratch memory, a row per range, shape (parts, n).
    """

    rows: Ints32
    columns: Ints32
    ranges: Ints32
    marker: Ints32


def triple_product(first: Rows, second: Rows, third: Rows, width: int, *, threads: int) -> ProductPattern:
    """Structural nonzeros of first · second · third, with ``width`` columns."""
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


_LANES = 8  # elements per batch, as in warpjld_kernels.fem_element


@dataclass(frozen=True, eq=False)
class Pattern:
    """Block sparsity pattern of a mesh's stiffness matrix.

    Attributes:
        rows: Start of each node's block row, shape (N + 1,).
        columns: Neighbours of each node, itself included, ascending, shape (B,).
        slots: Index of the block that nodes (a, b) of an element add to, shape (E, 64).
        starts: Start of each node's elements in ``incident``, shape (N + 1,).
        incident: Elements at each node, ascending, shape (8 E,).
    """

    rows: Ints32
    columns: Ints32
    slots: Ints32
    starts: Ints32
    incident: Ints32


@dataclass(frozen=True, eq=False)
class Batches:
    """Batches of eight elements, for ranges of rows that are assembled in parallel (see ``fem_element``)."""

    ranges: Ints32
    range_batches: Ints32
    elements: Ints32
    kinds: Ints32
    counts: Ints32


def pattern_of(mesh: HexMesh, *, threads: int | None = None) -> Pattern:
    """Block sparsity pattern of a mesh.

    Raises:
        InputError: A node that belongs to no element.
    """
    from warpjld_kernels import fem_pattern

    workers = threads_of(threads)
    count, elements = len(mesh.nodes), np.ascontiguousarray(mesh.elements)
    flat = elements.ravel()
    used = np.bincount(flat, minlength=count)
    if (used == 0).any():
        raise InputError(f"mesh: node {int(np.argmin(used))} belongs to no element")
    starts = np.zeros(count + 1, np.int32)
    np.cumsum(used, out=starts[1:])
    incident = (np.argsort(flat, kind="stable") // 8).astype(np.int32)
    numbers = np.arange(len(elements) + 1, dtype=np.int32)
    # node–element incidence · identity · element–node incidence
    product = triple_product((starts, incident), (numbers, numbers[:-1]), (8 * numbers, flat), count, threads=workers)
    slots = np.empty((len(elements), 64), np.int32)
    on_rows(
        fem_pattern.element_slots,
        len(elements),
        [shared(elements), shared(product.rows), shared(product.columns), shared(slots)],
        threads=workers,
    )
    return Pattern(product.rows, product.columns, slots, starts, incident)


def batches_of(pattern: Pattern, kinds: Ints32, parts: int) -> Batches:
    """Divide the rows into ``parts`` ranges of equal work, and the elements of each range into batches of one law."""
    count = len(pattern.starts) - 1
    edges = np.searchsorted(pattern.starts, np.linspace(0, pattern.starts[-1], parts + 1)).astype(np.int32)
    edges[0], edges[-1] = 0, count
    elements, owner, sizes = [], [], []
    first = [0]
    for low, high in pairwise(edges):
        touched = np.unique(pattern.incident[pattern.starts[low] : pattern.starts[high]])
        for kind in np.unique(kinds[touched]):
            chosen = touched[kinds[touched] == kind]
            full = -(-len(chosen) // _LANES)
            filled = np.full(full * _LANES, chosen[-1], np.int32)
            filled[: len(chosen)] = chosen
            elements.append(filled.reshape(-1, _LANES))
            owner.append(np.full(full, kind, np.int32))
            size = np.full(full, _LANES, np.int32)
            size[-1] = len(chosen) - (full - 1) * _LANES
            sizes.append(size)
        first.append(sum(map(len, owner)))
    return Batches(
        edges, np.array(first, np.int32), np.concatenate(elements), np.concatenate(owner), np.concatenate(sizes)
    )
