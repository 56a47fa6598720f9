"""Display correction: removes the residual overlap of visible surfaces that finite elements leave (R104).

Contact is enforced on average over element faces. Visible surfaces are finer, and between nodes they overlap or gape by
a fraction of an element. Overlaps are removed by moving both surfaces in inverse proportion to their stiffness, and two
parts of one hand by half each. Skin that passes through itself anywhere is drawn back first (``uncross``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.bodies.skin_parts import SkinParts
from warpjld.simulation.display.overlap import Overlap, SurfacePart, overlap_of, self_overlaps
from warpjld.simulation.display.uncross import SkinCrossings, uncrossed

__all__ = ["SeparatedSurfaces", "VisibleSurface", "overlaps_before", "separate_surfaces"]

_ROUNDS = 3
"""Iterations of moving two surfaces apart in proportion."""


@dataclass(frozen=True, eq=False)
class VisibleSurface:
    """Visible surface of a deformable body.

    Attributes:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3); vertices without triangles are not moved.
        modulus: Young's modulus below the surface [Pa].
        most: Largest displacement of a vertex [m]: a fraction of an element.
        parts: Parts of it that may overlap one another; None if it has none.
        pressing: Mask of vertices whose overlap with other parts is resolved by contact, shape (V,); None: all.
        crossings: What finds crossings of the surface with itself; None if they are not removed.
        sound: Vertices that folds return to, each tried in turn [m], shape (V, 3): not smoothed, and the covering's.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    modulus: float
    most: float
    parts: SkinParts | None = None
    pressing: NDArray[np.bool_] | None = None
    crossings: SkinCrossings | None = None
    sound: tuple[NDArray[np.float64], ...] = ()


@dataclass(frozen=True, eq=False)
class SeparatedSurfaces:
    """Visible surfaces after the display correction.

    Attributes:
        vertices: Vertices of every surface [m], shape (V, 3), by name.
        moved: Largest displacement of each [m], by name.
        inside: Remaining overlaps that are too deep to be removed, by surface (or part) and by what its vertices are
            in.
    """

    vertices: dict[str, NDArray[np.float64]]
    moved: dict[str, float]
    inside: dict[tuple[SurfacePart, SurfacePart], Overlap] = field(default_factory=dict)

    @property
    def left(self) -> dict[tuple[SurfacePart, SurfacePart], float]:
        """Depth of the remaining overlap of each two surfaces or parts [m]."""
        out: dict[tuple[SurfacePart, SurfacePart], float] = {}
        for (one, other), found in self.inside.items():
            two = (other, one) if (other, one) in out else (one, other)
            out[two] = max(found.depth, out.get(two, 0.0))
        return out


def separate_surfaces(
    surfaces: Mapping[str, VisibleSurface], obstacles: Mapping[str, Obstacle], time: float
) -> SeparatedSurfaces:
    """Move vertices that are inside other surfaces or obstacles onto their surfaces.

    Args:
        surfaces: Visible surfaces by name.
        obstacles: Rigid obstacles by name.
        time: Time at which the obstacles are evaluated [frames].
    """
    bodies = {name: _MovingSurface(shown) for name, shown in surfaces.items()}
    pairs = _near(bodies)
    for body in bodies.values():
        body.uncross()
        body.separate_parts()
    for one, other in pairs:
        a, b = bodies[one], bodies[other]
        share = b.shown.modulus / (a.shown.modulus + b.shown.modulus)
        for _ in range(_ROUNDS):
            mine, theirs = b.containing(a), a.containing(b)
            a.move_out(mine, share)
            b.move_out(theirs, 1.0 - share)
        soft, hard = (a, b) if share >= 0.5 else (b, a)
        soft.move_out(hard.containing(soft), 1.0)
        hard.move_out(soft.containing(hard), 1.0)
    for body in bodies.values():
        for obstacle in obstacles.values():
            body.move_out(body.inside(obstacle, time), 1.0)
    for body in bodies.values():
        body.uncross()
    return SeparatedSurfaces(
        {name: body.at for name, body in bodies.items()},
        {name: body.moved for name, body in bodies.items()},
        _inside(bodies, pairs, obstacles, time),
    )


def overlaps_before(
    surfaces: Mapping[str, VisibleSurface], obstacles: Mapping[str, Obstacle], time: float
) -> dict[tuple[SurfacePart, SurfacePart], Overlap]:
    """Overlaps before anything is moved, by surface (or part) and by what its vertices are in; arguments as there."""
    bodies = {name: _MovingSurface(shown) for name, shown in surfaces.items()}
    return _inside(bodies, _near(bodies), obstacles, time)


def _near(bodies: Mapping[str, _MovingSurface]) -> list[tuple[str, str]]:
    """Names of every two surfaces that are near each other."""
    names = list(bodies)
    pairs = [(one, other) for k, one in enumerate(names) for other in names[k + 1 :]]
    return [pair for pair in pairs if bodies[pair[0]].near(bodies[pair[1]])]


def _inside(
    bodies: Mapping[str, _MovingSurface], pairs: list[tuple[str, str]], obstacles: Mapping[str, Obstacle], time: float
) -> dict[tuple[SurfacePart, SurfacePart], Overlap]:
    """Overlaps of pairs of surfaces, of parts of one, and with obstacles."""
    inside: dict[tuple[SurfacePart, SurfacePart], Overlap] = {}
    for one, other in pairs:
        inside[SurfacePart(one), SurfacePart(other)] = bodies[other].containing(bodies[one])
        inside[SurfacePart(other), SurfacePart(one)] = bodies[one].containing(bodies[other])
    for name, body in bodies.items():
        parts = sorted(body.part_overlaps().items(), key=lambda item: item[0])
        inside |= {(SurfacePart(name, part), SurfacePart(name, other)): found for (part, other), found in parts}
        for solid, obstacle in obstacles.items():
            inside[SurfacePart(name), SurfacePart(solid)] = body.inside(obstacle, time)
    return inside


class _MovingSurface:
    """A visible surface while it is being corrected."""

    def __init__(self, shown: VisibleSurface) -> None:
        self.shown = shown
        self.at = np.array(shown.vertices, dtype=np.float64)
        self._used = np.unique(shown.faces)
        self._facets: Facets | None = None
        self._facets_moved = False
        self._between_parts: Mapping[tuple[str, str], Overlap] | None = None

    @property
    def moved(self) -> float:
        return float(np.linalg.norm(self.at - self.shown.vertices, axis=1).max(initial=0.0))

    def near(self, other: _MovingSurface) -> bool:
        """Whether the bounding boxes of two surfaces overlap."""
        (low, high), (bottom, top) = ((x.min(axis=0), x.max(axis=0)) for x in (self._points, other._points))
        return bool(((low <= top) & (bottom <= high)).all())

    def containing(self, other: _MovingSurface) -> Overlap:
        """Vertices of another surface that are inside this one."""
        bottom, top = self._points.min(axis=0), self._points.max(axis=0)
        x = other._points
        tested = other._used[((x >= bottom) & (x <= top)).all(axis=1)]
        if not len(tested):
            return Overlap(tested, np.empty((0, 3)))
        if self._facets is None:
            self._facets = Facets(self.at.copy(), self.shown.faces)
        elif self._facets_moved:
            self._facets.move(self.at.copy())
        self._facets_moved = False
        found = self._facets.project(other.at[tested])
        return overlap_of(other.at, other._normals(), tested, found)[0]

    def inside(self, obstacle: Obstacle, time: float) -> Overlap:
        """Vertices of this surface that are inside an obstacle."""
        return overlap_of(self.at, self._normals(), self._used, obstacle.project(self._points, time))[0]

    def part_overlaps(self) -> Mapping[tuple[str, str], Overlap]:
        """Overlaps between the parts of this surface."""
        parts = self.shown.parts
        if self._between_parts is None:
            self._between_parts = {} if parts is None else self_overlaps(parts, self.at, self._normals())
        return self._between_parts

    def uncross(self) -> None:
        """Draw skin back that passes through itself."""
        shown = self.shown
        if shown.crossings is not None:
            at = uncrossed(shown.crossings, self.at, shown.sound, shown.most)
            self._facets_moved = self._facets_moved or at is not self.at
            self.at, self._between_parts = at, None

    def separate_parts(self) -> None:
        """Move overlapping parts apart by half each, where contact resolves their overlap."""
        for turn in range(_ROUNDS + 2):
            found = self.part_overlaps()
            if self.shown.pressing is not None:
                found = {two: one.of(self.shown.pressing) for two, one in found.items()}
            if not any(len(one.vertices) for one in found.values()):
                return
            for (part, against), one in found.items():
                if turn < _ROUNDS:
                    self.move_out(one, 0.5)
                elif (part < against) == (turn == _ROUNDS):  # the rest: first one part, then the other
                    self.move_out(one, 1.0)

    def move_out(self, found: Overlap, share: float) -> None:
        """Move overlapping vertices by a share of their exit vectors, limited to the largest displacement."""
        if not len(found.vertices):
            return
        self._facets_moved, self._between_parts = True, None
        there = self.at[found.vertices] + share * found.exit
        start = self.shown.vertices[found.vertices]
        away = there - start
        length = np.linalg.norm(away, axis=1, keepdims=True)
        self.at[found.vertices] = start + away * np.minimum(1.0, self.shown.most / np.maximum(length, 1e-300))

    @property
    def _points(self) -> NDArray[np.float64]:
        return self.at[self._used]

    def _normals(self) -> NDArray[np.float64]:
        """Unit normals of its vertices, zero for vertices without faces."""
        x = self.at[self.shown.faces]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        out = np.stack(
            [np.bincount(self.shown.faces.ravel(), np.repeat(normal[:, k], 3), len(self.at)) for k in range(3)], axis=1
        )
        return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300))
