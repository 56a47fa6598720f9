"""Rigid objects to be grasped: a triangulated surface in its own frame, and its placement in the world."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.geometry.paint import SurfacePaint
from warpjld.geometry.surface import Part, weld_surface
from warpjld.grasp.feature_normals import face_normals
from warpjld.grasp.validation import MeshReport, mend

__all__ = ["GraspObject", "Places", "VolumeCells", "make_object"]


@dataclass(frozen=True, eq=False)
class Places:
    """P rigid placements: a point x of the object's frame has the world position rotation · x + position.

    Attributes:
        position: World position of the object's origin [m], shape (P, 3).
        rotation: Unit quaternions x, y, z, w, shape (P, 4).
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]

    @staticmethod
    def of(position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Places:
        """One or more placements; a single position is combined with many rotations, and vice versa.

        Rotations are normalised.

        Raises:
            InputError: Wrong shapes, not finite, or a zero quaternion.
        """
        at = np.atleast_2d(np.asarray(position, dtype=np.float64))
        turn = np.atleast_2d(np.asarray(rotation, dtype=np.float64))
        if at.shape[1:] != (3,) or turn.shape[1:] != (4,) or len({len(at), len(turn), 1}) > 2:
            raise InputError(f"places: want positions (n, 3) and rotations (n, 4), got {at.shape} and {turn.shape}")
        if not (np.isfinite(at).all() and np.isfinite(turn).all()):
            raise InputError("places: positions and rotations must be finite")
        length = np.linalg.norm(turn, axis=1, keepdims=True)
        if (length < 1e-9).any():
            raise InputError("places: a rotation quaternion has no length")
        count = max(len(at), len(turn))
        return Places(np.broadcast_to(at, (count, 3)).copy(), np.broadcast_to(turn / length, (count, 4)).copy())

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, which: Any) -> Places:
        return Places(np.atleast_2d(self.position[which]), np.atleast_2d(self.rotation[which]))

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """World positions [m], shape (P, n, 3), of points (n, 3) in the object's frame."""
        turn = Rotation.from_quat(self.rotation).as_matrix()
        local = np.asarray(points, dtype=np.float64)
        return np.einsum("pij,nj->pni", turn, local) + self.position[:, None]

    def to_local(self, points: ArrayLike) -> NDArray[np.float64]:
        """World points (n, 3) in the object's frame [m], shape (P, n, 3)."""
        turn = Rotation.from_quat(self.rotation).as_matrix()
        away = np.asarray(points, dtype=np.float64)[None] - self.position[:, None]
        return np.einsum("pji,pnj->pni", turn, away)


@dataclass(frozen=True, eq=False)
class VolumeCells:
    """Volume mesh of an object, read from a file.

    Attributes:
        nodes: Nodes in the object's frame [m], shape (N, 3).
        elements: Node indices of hexahedra; prisms and tetrahedra are degenerate ones, shape (E, 8).
        regions: Index of each element's region, shape (E,).
        region_names: Names of the regions.
    """

    nodes: NDArray[np.float64]
    elements: NDArray[np.int32]
    regions: NDArray[np.int32]
    region_names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class GraspObject:
    """A rigid object.

    Attributes:
        name: Name for messages.
        vertices: Positions in the object's frame [m], shape (n, 3).
        faces: Triangles, anticlockwise seen from outside, shape (t, 3).
        report: Defects of the surface that were found and repaired when it was made.
        place: Initial placement.
        origin: File it comes from, or name of the built-in shape.
        numbers: Index of every vertex in the file, shape (n,); None where it is the row.
        facets: Facet of the file (triangle or larger polygon) that every triangle is a part of, shape (t,); None where
            it is the row. Commands number facets as the file does (R133); functions that take a triangle say so.
        cells: Volume mesh of its file, if it has one.
        paint: Textures of its triangles, if its file has any.

    Examples:
        >>> ball = wj.shapes.ball(0.065).placed((0.0, -0.05, -0.06))
        >>> ball
        GraspObject('ball': 5120 facets, 0.065 × 0.065 × 0.065 m)
        >>> round(1e6 * ball.volume)  # cm³
        143
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    report: MeshReport = field(default_factory=MeshReport)
    place: Places = field(default_factory=Places.of)
    origin: str = ""
    numbers: NDArray[np.int64] | None = None
    facets: NDArray[np.int64] | None = None
    cells: VolumeCells | None = None
    paint: SurfacePaint | None = None

    def facet_of(self, triangle: int) -> int:
        """Number, in the file, of the facet that a triangle is a part of."""
        return triangle if self.facets is None else int(self.facets[triangle])

    def triangles_of(self, facet: int) -> NDArray[np.int64]:
        """Rows of the triangles that make up a facet of the file.

        Raises:
            InputError: There is no such facet, or its triangles were removed.
        """
        facets = np.arange(len(self.faces)) if self.facets is None else self.facets
        found = np.flatnonzero(facets == facet)
        if not len(found):
            if 0 <= facet <= facets.max():
                raise InputError(f"facet {facet} of {self.name} was taken out: it has no area, or is there twice")
            raise InputError(f"object {self.name} has facets 0 to {facets.max()}, got {facet}")
        return found

    def __repr__(self) -> str:
        x, y, z = self.size
        return f"GraspObject('{self.name}': {len(self.faces)} facets, {x:.3g} × {y:.3g} × {z:.3g} m)"

    def placed(self, position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> GraspObject:
        """Copy with another initial placement: position [m] and unit quaternion x, y, z, w."""
        return replace(self, place=Places.of(position, rotation))

    def scaled(self, factor: float) -> GraspObject:
        """Copy scaled about its own origin.

        Raises:
            InputError: A factor that is not a positive number.
        """
        if not (np.isfinite(factor) and factor > 0.0):
            raise InputError(f"scale: want a number above 0, got {factor:g}")
        cells = None if self.cells is None else replace(self.cells, nodes=self.cells.nodes * factor)
        return replace(self, vertices=self.vertices * factor, cells=cells)

    def check_facet(self, facet: int) -> int:
        """The row of a triangle.

        Raises:
            InputError: There is no such row; states the valid range.
        """
        if not 0 <= facet < len(self.faces):
            raise InputError(f"object {self.name} has facets 0 to {len(self.faces) - 1}, got {facet}")
        return int(facet)

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals of the facets, shape (t, 3); zero where there is no area."""
        return face_normals(self.vertices[self.faces])

    @cached_property
    def volume(self) -> float:
        """Enclosed volume [m³]; holes are closed by triangle fans around their centres."""
        from warpjld.covering.quality import enclosed_volume

        return float(enclosed_volume(self.vertices, self.faces))

    @cached_property
    def centroid(self) -> NDArray[np.float64]:
        """Centroid of the enclosed volume [m] (centre of mass at uniform density), shape (3,).

        Σ V_t (a + b + c) / 4 over tetrahedra from the mean vertex; the bounding box's centre where the surface is open
        or has no volume.
        """
        middle = self.vertices.mean(axis=0)
        a, b, c = (self.vertices[self.faces[:, k]] - middle for k in range(3))
        six = (a * np.cross(b, c)).sum(axis=1)
        if not self.report.watertight or abs(six.sum()) < 1e-15:
            return np.asarray((self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2.0)
        return np.asarray(middle + (six[:, None] * (a + b + c) / 4.0).sum(axis=0) / six.sum())

    @property
    def size(self) -> NDArray[np.float64]:
        """Extent along the axes of its own frame [m], shape (3,)."""
        return np.asarray(np.ptp(self.vertices, axis=0))


def make_object(
    name: str,
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    parts: tuple[Part, ...] = (),
    polygons: NDArray[np.int64] | None = None,
    origin: str = "",
    paint: SurfacePaint | None = None,
) -> GraspObject:
    """Make an object from arrays; vertices are welded, the surface is checked and repaired (see ``report``).

    Args:
        name: Name for messages.
        vertices: Positions [m], shape (n, 3).
        faces: Triangles, shape (t, 3).
        parts: Ranges of vertices and faces that are welded separately.
        polygons: Polygon that each triangle is a part of, shape (t,), where the file has larger polygons.
        origin: File or built-in shape it comes from.
        paint: Textures of the triangles.

    Raises:
        InputError: Empty, not finite, wrong shapes, or one-sided.

    Examples:
        >>> wj.make_object("wedge", [[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]],
        ...                [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        GraspObject('wedge': 4 facets, 0.05 × 0.05 × 0.05 m)
    """
    try:
        # borders of separate pieces are not joined: where three of them meet, the edge would be non-manifold
        apart = np.zeros(len(np.asarray(vertices)), dtype=bool)
        surface = weld_surface(vertices, faces, parts=parts, polygons=polygons, joins=apart)
        mended = mend(surface.vertices, surface.faces)
    except InputError as error:
        raise InputError(f"object {name}: {error.message}", path=error.path) from None
    kept = None
    if paint is not None:
        rows = surface.source_rows[mended.rows]
        before = np.asarray(vertices, np.float64)[np.asarray(faces)[rows]]
        kept = _kept_paint(paint, before, mended.vertices[mended.faces], rows)
    return GraspObject(
        name,
        mended.vertices,
        mended.faces,
        mended.report,
        origin=origin,
        numbers=surface.numbers[mended.used],
        facets=surface.facets[mended.rows],
        paint=kept,
    )


def _kept_paint(
    paint: SurfacePaint, before: NDArray[np.float64], now: NDArray[np.float64], rows: NDArray[np.int64]
) -> SurfacePaint:
    """Textures of the triangles that remain after mending; corners are matched by position, since mending flips some.

    Args:
        paint: Textures of all original triangles.
        before: Original positions of the corners of the remaining triangles [m], shape (t, 3, 3).
        now: Positions of their corners after mending [m], shape (t, 3, 3).
        rows: Indices of the remaining triangles among the original ones, shape (t,).
    """
    corner = np.linalg.norm(now[:, :, None] - before[:, None], axis=3).argmin(axis=2)
    return SurfacePaint(paint.corner_uv[rows[:, None], corner], paint.image[rows], paint.images)
