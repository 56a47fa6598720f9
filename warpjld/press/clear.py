"""What elements leave of overlap between visible surfaces is taken away before they are shown (R104).

Contact holds for averages over the faces of elements. Visible surfaces are finer: between nodes they still overlap here
and gape there by a fraction of an element. Overlaps are closed by moving both surfaces, the softer one more, so that
they lie on each other as the bodies do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.facets import Facets
from warpjld.fem.contact.obstacles import Touching

__all__ = ["Cleared", "Shown", "clear"]

_ROUNDS = 3
_FACING = 0.3
"""Surfaces that meet look at each other: cosine between their normals, at most."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A visible surface of a body that deforms.

    Attributes:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3); vertices of none stay.
        modulus: Of what lies under it [Pa].
        most: How far a vertex may be moved [m]: a fraction of an element.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    modulus: float
    most: float


@dataclass(frozen=True, eq=False)
class Cleared:
    """Surfaces that no longer overlap.

    Attributes:
        vertices: Of every surface [m], shape (V, 3).
        moved: Farthest move of each [m].
        left: Overlap of each two that is too deep to be a matter of elements and stays [m].
    """

    vertices: dict[str, NDArray[np.float64]]
    moved: dict[str, float]
    left: dict[tuple[str, str], float] = field(default_factory=dict)


def clear(surfaces: Mapping[str, Shown], obstacles: Mapping[str, Obstacle], time: float) -> Cleared:
    """Move the vertices of surfaces that are inside others, or inside obstacles, onto them.

    Args:
        surfaces: By name.
        obstacles: Which do not give way, by name.
        time: The obstacles' time.
    """
    bodies = {name: _Body(shown) for name, shown in surfaces.items()}
    names = list(bodies)
    pairs = [(one, other) for k, one in enumerate(names) for other in names[k + 1 :]]
    pairs = [pair for pair in pairs if bodies[pair[0]].near(bodies[pair[1]])]
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
    left: dict[tuple[str, str], float] = {}
    for one, other in pairs:
        left[one, other] = max(bodies[one].over(bodies[other]).depth, bodies[other].over(bodies[one]).depth)
    for name, body in bodies.items():
        for solid, obstacle in obstacles.items():
            left[name, solid] = body.sunk(obstacle, time).depth
    return Cleared(
        {name: body.at for name, body in bodies.items()},
        {name: body.moved for name, body in bodies.items()},
        left,
    )


@dataclass(frozen=True, eq=False)
class _Over:
    """Vertices that are inside something, and the way out [m]."""

    vertices: NDArray[np.integer]
    way: NDArray[np.float64]

    @property
    def depth(self) -> float:
        return float(np.linalg.norm(self.way, axis=1).max(initial=0.0))


class _Body:
    """A surface on the move."""

    def __init__(self, shown: Shown) -> None:
        self.shown = shown
        self.at = np.array(shown.vertices, dtype=np.float64)
        self._used = np.unique(shown.faces)

    @property
    def moved(self) -> float:
        return float(np.linalg.norm(self.at - self.shown.vertices, axis=1).max(initial=0.0))

    def near(self, other: _Body) -> bool:
        """Whether their boxes meet."""
        (low, high), (bottom, top) = ((x.min(axis=0), x.max(axis=0)) for x in (self._points, other._points))
        return bool(((low <= top) & (bottom <= high)).all())

    def over(self, other: _Body) -> _Over:
        """Vertices of the other surface that are inside this one."""
        bottom, top = self._points.min(axis=0), self._points.max(axis=0)
        x = other._points
        some = other._used[((x >= bottom) & (x <= top)).all(axis=1)]
        if not len(some):
            return _Over(some, np.empty((0, 3)))
        return other._inside(Facets(self.at, self.shown.faces).project(other.at[some]), some)

    def sunk(self, obstacle: Obstacle, time: float) -> _Over:
        """Vertices that are inside an obstacle."""
        return self._inside(obstacle.project(self._points, time), self._used)

    def _inside(self, found: Touching, some: NDArray[np.integer]) -> _Over:
        """Of vertices for which something was found, those inside that look at what they are in."""
        facing = np.einsum("vi,vi->v", self._normals()[some], found.normal) < _FACING
        chosen = (found.distance < 0.0) & facing
        return _Over(some[chosen], found.closest[chosen] - self.at[some[chosen]])

    def put(self, over: _Over, share: float) -> None:
        """Move vertices a share of the way out, no farther than may be."""
        there = self.at[over.vertices] + share * over.way
        start = self.shown.vertices[over.vertices]
        away = there - start
        length = np.linalg.norm(away, axis=1, keepdims=True)
        self.at[over.vertices] = start + away * np.minimum(1.0, self.shown.most / np.maximum(length, 1e-300))

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
