"""What elements leave of overlap between visible surfaces is taken away before they are shown (R104).

Contact holds for averages over the faces of elements. Visible surfaces are finer: between nodes they still overlap here
and gape there by a fraction of an element. Overlaps are closed by moving both surfaces, the softer one more, so that
they lie on each other as the bodies do; of a hand's own parts both move half the way.
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

__all__ = ["SeparatedSurfaces", "VisibleSurface", "separate_surfaces"]

_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class VisibleSurface:
    """A visible surface of a body that deforms.

    Attributes:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3); vertices of none stay.
        modulus: Of what lies under it [Pa].
        most: How far a vertex may be moved [m]: a fraction of an element.
        parts: Parts of it that may overlap, if any.
        pressing: Vertices whose overlap with other parts contact knows of, shape (V,); None: all.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    modulus: float
    most: float
    parts: SkinParts | None = None
    pressing: NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class SeparatedSurfaces:
    """Surfaces that no longer overlap.

    Attributes:
        vertices: Of every surface [m], shape (V, 3).
        moved: Farthest move of each [m].
        inside: Vertices that stay inside something, too deep to be a matter of elements, by the surface's name and that
            of what they are in; parts of one surface by its name and theirs.
    """

    vertices: dict[str, NDArray[np.float64]]
    moved: dict[str, float]
    inside: dict[tuple[SurfacePart, SurfacePart], Overlap] = field(default_factory=dict)

    @property
    def left(self) -> dict[tuple[SurfacePart, SurfacePart], float]:
        """Overlap that stays of each two [m]."""
        out: dict[tuple[SurfacePart, SurfacePart], float] = {}
        for (one, other), found in self.inside.items():
            two = (other, one) if (other, one) in out else (one, other)
            out[two] = max(found.depth, out.get(two, 0.0))
        return out


def separate_surfaces(
    surfaces: Mapping[str, VisibleSurface], obstacles: Mapping[str, Obstacle], time: float
) -> SeparatedSurfaces:
    """Move the vertices of surfaces that are inside others, or inside obstacles, onto them.

    Args:
        surfaces: By name.
        obstacles: Which do not give way, by name.
        time: The obstacles' time.
    """
    bodies = {name: _MovingSurface(shown) for name, shown in surfaces.items()}
    names = list(bodies)
    pairs = [(one, other) for k, one in enumerate(names) for other in names[k + 1 :]]
    pairs = [pair for pair in pairs if bodies[pair[0]].near(bodies[pair[1]])]
    for body in bodies.values():
        body.part_itself()
    for one, other in pairs:
        a, b = bodies[one], bodies[other]
        share = b.shown.modulus / (a.shown.modulus + b.shown.modulus)
        for _ in range(_ROUNDS):
            mine, theirs = b.over(a), a.over(b)
            a.put(mine, share)
            b.put(theirs, 1.0 - share)
        soft, hard = (a, b) if share >= 0.5 else (b, a)
        soft.put(hard.over(soft), 1.0)
        hard.put(soft.over(hard), 1.0)
    for body in bodies.values():
        for obstacle in obstacles.values():
            body.put(body.sunk(obstacle, time), 1.0)
    inside: dict[tuple[SurfacePart, SurfacePart], Overlap] = {}
    for one, other in pairs:
        inside[SurfacePart(one), SurfacePart(other)] = bodies[other].over(bodies[one])
        inside[SurfacePart(other), SurfacePart(one)] = bodies[one].over(bodies[other])
    for name, body in bodies.items():
        parts = sorted(body.itself().items(), key=lambda item: item[0])
        inside |= {(SurfacePart(name, part), SurfacePart(name, other)): found for (part, other), found in parts}
        for solid, obstacle in obstacles.items():
            inside[SurfacePart(name), SurfacePart(solid)] = body.sunk(obstacle, time)
    return SeparatedSurfaces(
        {name: body.at for name, body in bodies.items()},
        {name: body.moved for name, body in bodies.items()},
        inside,
    )


class _MovingSurface:
    """A surface on the move."""

    def __init__(self, shown: VisibleSurface) -> None:
        self.shown = shown
        self.at = np.array(shown.vertices, dtype=np.float64)
        self._used = np.unique(shown.faces)

    @property
    def moved(self) -> float:
        return float(np.linalg.norm(self.at - self.shown.vertices, axis=1).max(initial=0.0))

    def near(self, other: _MovingSurface) -> bool:
        """Whether their boxes meet."""
        (low, high), (bottom, top) = ((x.min(axis=0), x.max(axis=0)) for x in (self._points, other._points))
        return bool(((low <= top) & (bottom <= high)).all())

    def over(self, other: _MovingSurface) -> Overlap:
        """Vertices of the other surface that are inside this one."""
        bottom, top = self._points.min(axis=0), self._points.max(axis=0)
        x = other._points
        some = other._used[((x >= bottom) & (x <= top)).all(axis=1)]
        if not len(some):
            return Overlap(some, np.empty((0, 3)))
        found = Facets(self.at, self.shown.faces).project(other.at[some])
        return overlap_of(other.at, other._normals(), some, found)[0]

    def sunk(self, obstacle: Obstacle, time: float) -> Overlap:
        """Vertices that are inside an obstacle."""
        return overlap_of(self.at, self._normals(), self._used, obstacle.project(self._points, time))[0]

    def itself(self) -> Mapping[tuple[str, str], Overlap]:
        """Vertices of its parts that are inside other parts."""
        parts = self.shown.parts
        return {} if parts is None else self_overlaps(parts, self.at, self._normals())

    def part_itself(self) -> None:
        """Move the vertices of both parts that overlap half the way out, as far as contact knows of them."""
        for turn in range(_ROUNDS + 2):
            found = self.itself()
            if self.shown.pressing is not None:
                found = {two: one.of(self.shown.pressing) for two, one in found.items()}
            if not any(len(one.vertices) for one in found.values()):
                return
            for (part, against), one in found.items():
                if turn < _ROUNDS:
                    self.put(one, 0.5)
                elif (part < against) == (turn == _ROUNDS):  # what is left: first the one part, then the other
                    self.put(one, 1.0)

    def put(self, found: Overlap, share: float) -> None:
        """Move vertices a share of the way out, no farther than may be."""
        there = self.at[found.vertices] + share * found.way
        start = self.shown.vertices[found.vertices]
        away = there - start
        length = np.linalg.norm(away, axis=1, keepdims=True)
        self.at[found.vertices] = start + away * np.minimum(1.0, self.shown.most / np.maximum(length, 1e-300))

    @property
    def _points(self) -> NDArray[np.float64]:
        return self.at[self._used]

    def _normals(self) -> NDArray[np.float64]:
        """Unit normals of its vertices, zero for those of no face."""
        x = self.at[self.shown.faces]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        out = np.stack(
            [np.bincount(self.shown.faces.ravel(), np.repeat(normal[:, k], 3), len(self.at)) for k in range(3)], axis=1
        )
        return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300))
