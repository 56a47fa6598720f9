"""Checking an object's surface: what can be mended is mended and told, what cannot is refused."""

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

__all__ = ["Mended", "MeshReport", "mend"]

_FLAT = 1e-9  # height of a triangle over its longest edge below which it counts as degenerate


@dataclass(frozen=True)
class MeshReport:
    """What was found on a surface.

    Attributes:
        degenerate: Triangles without area, taken out.
        duplicates: Triangles that were there before, taken out.
        flipped: Triangles turned round so that all look outwards.
        open_edges: Edges with a triangle on one side only.
        components: Connected pieces.
        crossing: Triangles that pass through others.
        solid: Whether it is the border of a solid: closed, all pieces outward (or cavities, inward), none crossing.
            Only then does the nearest point alone tell inside from outside; elsewhere the winding number does.
    """

    degenerate: int = 0
    duplicates: int = 0
    flipped: int = 0
    open_edges: int = 0
    components: int = 1
    crossing: int = 0
    solid: bool = True

    @property
    def watertight(self) -> bool:
        """Whether every edge has two triangles."""
        return self.open_edges == 0

    def notes(self) -> list[str]:
        """What a user should know; empty where nothing is amiss."""
        found = []
        if self.degenerate:
            found.append(f"{self.degenerate} degenerate triangles taken out")
        if self.duplicates:
            found.append(f"{self.duplicates} duplicate triangles taken out")
        if self.flipped:
            found.append(f"{self.flipped} triangles turned to look outwards")
        if self.open_edges:
            found.append(f"not watertight: {self.open_edges} open edges; inside and outside by winding number")
        if self.crossing:
            found.append(f"{self.crossing} triangles cross others; inside and outside by winding number")
        if self.watertight and not self.crossing and not self.solid:
            found.append("pieces lie inside one another; inside and outside by winding number")
        return found


@dataclass(frozen=True, eq=False)
class Mended:
    """A surface with degenerate and duplicate triangles taken out and all triangles looking outwards.

    Attributes:
        vertices: Those in use [m], shape (n, 3).
        faces: Triangles, shape (t, 3).
        report: What was found.
        used: Vertex before, of every vertex, shape (n,).
        rows: Triangle before, of every triangle, shape (t,).
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    report: MeshReport
    used: NDArray[np.int64]
    rows: NDArray[np.int64]


def mend(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Mended:
    """A surface with degenerate and duplicate triangles taken out and all triangles looking outwards.

    Args:
        vertices: Welded positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).

    Raises:
        InputError: No triangle with an area, an edge with more than two triangles, or a one-sided (Möbius) surface.
    """
    rows, degenerate, duplicates = _without_waste(vertices, faces)
    kept = faces[rows]
    if not len(kept):
        raise InputError("the surface is empty: it has no triangle with an area")
    used, compact = np.unique(kept, return_inverse=True)
    points, triangles = vertices[used], compact.reshape(kept.shape).astype(np.int32)
    first, second, same, open_edges = _adjacency(points, triangles)
    piece, wrong = _orientation(len(triangles), first, second, same)
    turn = wrong ^ _look_inwards(points, _turned(triangles, wrong), piece)[piece]
    triangles = _turned(triangles, turn)
    crossing = len(crossing_faces(points, triangles).faces)
    solid = open_edges == 0 and crossing == 0 and _nested_properly(points, triangles, piece)
    report = MeshReport(degenerate, duplicates, int(turn.sum()), open_edges, int(piece.max()) + 1, crossing, solid)
    return Mended(points, triangles, report, used.astype(np.int64), rows)


def _without_waste(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[NDArray[np.int64], int, int]:
    """Rows of the faces that are kept, and how many have no area or are there twice."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    longest = np.max([np.linalg.norm(v, axis=1) for v in (b - a, c - b, a - c)], axis=0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    flat = area <= _FLAT * longest**2
    solid = np.flatnonzero(~flat)
    _, once, times = np.unique(np.sort(faces[solid], axis=1), axis=0, return_index=True, return_counts=True)
    kept, twice = solid[np.sort(once)], (times > 1)[np.argsort(once)]
    if twice.any():  # where one of a pair would still hang on a closed surface, the pair was a fold without volume
        kept = kept[~(twice & _on_crowded_edge(faces[kept]))]
    return kept, int(flat.sum()), len(solid) - len(kept)


def _on_crowded_edge(faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Faces with an edge of more than two faces."""
    half = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, place, count = np.unique(half, axis=0, return_inverse=True, return_counts=True)
    return np.asarray((count[place] > 2).reshape(3, -1).any(axis=0))


def _adjacency(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_], int]:
    """Pairs of faces with a common edge, whether both run along it in the same direction, and the open edges."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    owner = np.tile(np.arange(len(faces)), 3)
    low, high = half.min(axis=1), half.max(axis=1)
    order = np.lexsort((high, low))
    low, high, forward, owner = low[order], high[order], (half[:, 0] < half[:, 1])[order], owner[order]
    begins = np.flatnonzero(np.r_[True, (low[1:] != low[:-1]) | (high[1:] != high[:-1])])
    count = np.diff(np.r_[begins, len(low)])
    if (count > 2).any():
        edge = begins[np.argmax(count > 2)]
        x, y, z = (vertices[low[edge]] + vertices[high[edge]]) / 2
        raise InputError(
            f"the surface is not manifold: {int((count > 2).sum())} edges belong to more than two triangles, "
            f"the first near ({x:.4g}, {y:.4g}, {z:.4g}); mend it in a mesh editor"
        )
    pair = begins[count == 2]
    return owner[pair], owner[pair + 1], forward[pair] == forward[pair + 1], int((count == 1).sum())


def _orientation(
    count: int, first: NDArray[np.int64], second: NDArray[np.int64], same: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Piece of every face, and the faces that run against the majority of their piece.

    Every face stands twice in a graph, as it is and turned round; links join the states that fit together. A piece is
    then two connected parts, one the other turned round, unless the surface has one side only.
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
    """Pieces that must be turned: those of negative volume, unless they are cavities of a piece around them."""
    pieces = [faces[piece == k] for k in range(int(piece.max()) + 1)]
    volume = np.array([float(enclosed_volume(vertices, part)) for part in pieces])
    inwards = volume < 0.0
    largest = np.abs(volume).argmax()
    outer = pieces[largest][:, ::-1] if inwards[largest] else pieces[largest]
    for k in range(len(pieces)):
        if inwards[k] != inwards[largest]:
            # a cavity looks the other way from the piece around it, whichever way that one looked
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
