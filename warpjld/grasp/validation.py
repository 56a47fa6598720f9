"""Validation and repair of an object's surface: orientation, degenerate and duplicate triangles, non-manifold edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from warpjld.covering.intersections import crossing_faces
from warpjld.covering.quality import enclosed_volume
from warpjld.errors import InputError
from warpjld.geometry.winding import winding_numbers
from warpjld.grasp.non_manifold_edges import pairs_round_edge, separate_pieces, turned_patches

__all__ = ["Mended", "MeshReport", "mend"]

_FLAT = 1e-9  # ratio of a triangle's height to its longest edge below which it is degenerate


@dataclass(frozen=True)
class MeshReport:
    """Defects found on a surface, and what was repaired.

    Attributes:
        degenerate: Number of triangles without area, removed.
        duplicates: Number of repeated triangles, removed.
        flipped: Number of triangles whose orientation was reversed so that all face outwards.
        open_edges: Number of edges with a triangle on one side only.
        components: Number of connected pieces.
        crossing: Number of triangles that intersect others.
        non_manifold: Number of edges with more than two triangles; the pieces that meet there were separated.
        solid: Whether the surface bounds a solid: closed, all pieces oriented outwards (cavities inwards), none
            intersecting. Only then is the sign of the distance taken from the closest point; otherwise from the winding
            number.
    """

    degenerate: int = 0
    duplicates: int = 0
    flipped: int = 0
    open_edges: int = 0
    components: int = 1
    crossing: int = 0
    solid: bool = True
    non_manifold: int = 0

    @property
    def watertight(self) -> bool:
        """Whether every edge has two triangles."""
        return self.open_edges == 0

    def notes(self) -> list[str]:
        """Readable texts about the defects; empty where there are none."""
        found = []
        if self.degenerate:
            found.append(f"{self.degenerate} degenerate triangles removed")
        if self.duplicates:
            found.append(f"{self.duplicates} duplicate triangles removed")
        if self.flipped:
            found.append(f"{self.flipped} triangles flipped to face outwards")
        if self.non_manifold:
            found.append(
                f"{self.non_manifold} edges belong to more than two triangles: pieces that meet there are separated"
            )
        if self.open_edges:
            found.append(f"not watertight: {self.open_edges} open edges; inside and outside by winding number")
        if self.crossing:
            found.append(f"{self.crossing} triangles intersect others; inside and outside by winding number")
        if self.watertight and not self.crossing and not self.solid:
            found.append("pieces touch or lie inside one another; inside and outside by winding number")
        return found


@dataclass(frozen=True, eq=False)
class Mended:
    """A repaired surface.

    Attributes:
        vertices: Positions of the vertices in use [m], shape (n, 3).
        faces: Triangles, facing outwards, shape (t, 3).
        report: Defects that were found and repaired.
        used: Original index of every vertex, shape (n,).
        rows: Original index of every triangle, shape (t,).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    report: MeshReport
    used: NDArray[np.int64]
    rows: NDArray[np.int64]


def mend(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Mended:
    """Repair a surface: remove degenerate and duplicate triangles, orient all triangles outwards.

    Pieces that share non-manifold edges are separated; each gets vertices of its own.

    Args:
        vertices: Welded positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).

    Raises:
        InputError: No triangle with an area, or a one-sided (Möbius) surface.
    """
    rows, degenerate, duplicates = _without_waste(vertices, faces)
    kept = faces[rows]
    if not len(kept):
        raise InputError("the surface is empty: it has no triangle with an area")
    used, compact = np.unique(kept, return_inverse=True)
    points, triangles = vertices[used], compact.reshape(kept.shape).astype(np.int32)
    edges = _Edges.of(triangles)
    pairs, non_manifold = edges.pairs, int((edges.count > 2).sum())
    piece, turn = edges.pieces(pairs)
    if non_manifold:
        turn ^= turned_patches(points, _turned(triangles, turn), piece)[piece]
        edges = _Edges.of(_turned(triangles, turn))
        pairs = np.concatenate([edges.pairs, edges.pairs_at_non_manifold(points)])
        piece, wrong = edges.pieces(pairs)
        turn ^= wrong
        points, triangles, own = separate_pieces(points, triangles, piece)
        used = used[own]
    open_edges = 3 * len(triangles) - 2 * len(pairs)
    turn = turn ^ _look_inwards(points, _turned(triangles, turn), piece)[piece]
    triangles = _turned(triangles, turn)
    crossing = len(crossing_faces(points, triangles).faces)
    solid = open_edges == 0 and crossing == 0 and _nested_properly(points, triangles, piece)
    report = MeshReport(
        degenerate, duplicates, int(turn.sum()), open_edges, int(piece.max()) + 1, crossing, solid, non_manifold
    )
    return Mended(points, triangles, report, used.astype(np.int64), rows)


def _without_waste(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[NDArray[np.int64], int, int]:
    """Rows of the faces that are kept, the number without area, and the number of duplicates."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    longest = np.max([np.linalg.norm(v, axis=1) for v in (b - a, c - b, a - c)], axis=0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    flat = area <= _FLAT * longest**2
    solid = np.flatnonzero(~flat)
    _, once, times = np.unique(np.sort(faces[solid], axis=1), axis=0, return_index=True, return_counts=True)
    kept, twice = solid[np.sort(once)], (times > 1)[np.argsort(once)]
    if (
        twice.any()
    ):  # a duplicated face that is left on a non-manifold edge is a fold without volume: remove both copies
        kept = kept[~(twice & _on_non_manifold_edge(faces[kept]))]
    return kept, int(flat.sum()), len(solid) - len(kept)


def _on_non_manifold_edge(faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Mask of the faces with an edge that belongs to more than two faces, shape (T,)."""
    half = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, place, count = np.unique(half, axis=0, return_inverse=True, return_counts=True)
    return np.asarray((count[place] > 2).reshape(3, -1).any(axis=0))


@dataclass(frozen=True, eq=False)
class _Edges:
    """Sides (half-edges) of faces, sorted so that those of the same edge are consecutive.

    Attributes:
        low: End with the lower vertex index, shape (3 T,); likewise ``high``, and ``opposite``, the third corner.
        forward: Whether the face traverses the side from low to high, shape (3 T,).
        owner: The face, shape (3 T,).
        begins: First side of every edge, shape (E,).
        count: Number of sides of every edge, shape (E,).
    """

    low: NDArray[np.int64]
    high: NDArray[np.int64]
    opposite: NDArray[np.int64]
    forward: NDArray[np.bool_]
    owner: NDArray[np.int64]
    begins: NDArray[np.int64]
    count: NDArray[np.int64]

    @staticmethod
    def of(faces: NDArray[np.int32]) -> _Edges:
        """Sides of triangles (T, 3)."""
        half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
        opposite = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]]).astype(np.int64)
        low, high = half.min(axis=1), half.max(axis=1)
        order = np.lexsort((high, low))
        low, high, forward = low[order], high[order], (half[:, 0] < half[:, 1])[order]
        begins = np.flatnonzero(np.r_[True, (low[1:] != low[:-1]) | (high[1:] != high[:-1])])
        owner = np.tile(np.arange(len(faces)), 3)[order]
        return _Edges(low, high, opposite[order], forward, owner, begins, np.diff(np.r_[begins, len(low)]))

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Pairs of sides of the manifold edges (those with two sides), shape (n, 2)."""
        first = self.begins[self.count == 2]
        return np.stack([first, first + 1], axis=1)

    def pairs_at_non_manifold(self, vertices: NDArray[np.float64]) -> NDArray[np.int64]:
        """Pairs of sides that belong together at non-manifold edges, shape (n, 2)."""
        found: list[tuple[int, int]] = []
        for edge in np.flatnonzero(self.count > 2).tolist():
            first = int(self.begins[edge])
            sides = slice(first, first + int(self.count[edge]))
            ends = vertices[self.low[first]], vertices[self.high[first]]
            pairs = pairs_round_edge(*ends, vertices[self.opposite[sides]], self.forward[sides])
            found += [(first + a, first + b) for a, b in pairs]
        return np.array(found, dtype=np.int64).reshape(-1, 2)

    def pieces(self, pairs: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """Piece of every face when these pairs of sides are joined, and mask of the faces to flip in their piece."""
        first, second = pairs.T
        same = self.forward[first] == self.forward[second]
        return _orientation(len(self.low) // 3, self.owner[first], self.owner[second], same)


def _orientation(
    count: int, first: NDArray[np.int64], second: NDArray[np.int64], same: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Piece of every face, and mask of the faces whose orientation disagrees with the majority of their piece.

    Graph with two nodes per face, as it is and flipped; edges join orientations that agree. An orientable piece gives
    two connected components, one the flip of the other; a one-sided surface gives a single one.

    Args:
        count: Number of faces.
        first: One face of every pair of neighbours, shape (n,); likewise ``second``.
        same: Whether the two traverse their common edge in the same direction, shape (n,).

    Raises:
        InputError: A one-sided surface.
    """
    turn = np.where(same, count, 0)
    rows = np.concatenate([first, first + count])
    columns = np.concatenate([second + turn, second + count - turn])
    states = coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * count,) * 2)
    label = connected_components(states, directed=False)[1]
    as_is, turned = label[:count], label[count:]
    if (as_is == turned).any():
        raise InputError("the surface has one side only (a Möbius strip): it has no inside")
    _, piece = np.unique(np.minimum(as_is, turned), return_inverse=True)
    against = as_is > turned
    share = np.bincount(piece, weights=against) / np.bincount(piece)
    return piece.astype(np.int32), np.where(share[piece] > 0.5, ~against, against)


def _look_inwards(vertices: NDArray[np.float64], faces: NDArray[np.int32], piece: NDArray[np.int32]) -> NDArray:
    """Mask of the pieces to flip: those with negative volume, unless they are cavities of the piece around them."""
    pieces = [faces[piece == k] for k in range(int(piece.max()) + 1)]
    volume = np.array([float(enclosed_volume(vertices, part)) for part in pieces])
    inwards = volume < 0.0
    largest = np.abs(volume).argmax()
    outer = pieces[largest][:, ::-1] if inwards[largest] else pieces[largest]
    for k in range(len(pieces)):
        if inwards[k] != inwards[largest]:
            # a cavity is oriented opposite to the piece around it, whichever orientation that one had
            within = winding_numbers(vertices, outer, vertices[pieces[k][:1, 0]])[0] > 0.5
            inwards[k] = inwards[largest] if within else inwards[k]
    return inwards


def _nested_properly(vertices: NDArray[np.float64], faces: NDArray[np.int32], piece: NDArray[np.int32]) -> bool:
    """Whether outward pieces lie outside all others, and cavities inside exactly one."""
    for k in range(int(piece.max()) + 1) if piece.max() else ():
        own = faces[piece == k]
        others = winding_numbers(vertices, faces[piece != k], vertices[own[:1, 0]])[0]
        wanted = 0.0 if float(enclosed_volume(vertices, own)) > 0.0 else 1.0
        if abs(others - wanted) > 0.1:
            return False
    return True


def _turned(faces: NDArray[np.int32], which: NDArray[np.bool_]) -> NDArray[np.int32]:
    return np.where(which[:, None], faces[:, ::-1], faces)
