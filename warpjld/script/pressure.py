"""Display of actors and objects coloured by contact pressure (R95)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld import render
from warpjld.simulation.display.refine import RefinedSurface, refine_surface

if TYPE_CHECKING:
    from warpjld.script.crowd import Crowd
    from warpjld.script.props import Prop

__all__ = ["PressureView"]


class PressureView:
    """All deformable bodies as one coloured surface; or a single actor or object, with nothing in front of it.

    Args:
        crowd: Actors and objects with their contact solution.
        only: Name of the one to show; None for all.
        digits: Digits of it to show, or ``palm``; empty for all.
    """

    def __init__(self, crowd: Crowd, only: str | None, digits: Sequence[str] = ()) -> None:
        self.crowd = crowd
        self._only = only
        counts = np.cumsum([0, *(len(role.covering.surface.vertices) for role in crowd.roles)])
        self._roles = [
            (role, slice(a, b))
            for role, a, b in zip(crowd.roles, counts[:-1], counts[1:], strict=True)
            if only in (None, role.actor.name)
        ]
        pressed = crowd.pressed
        colored = [p for p in crowd.props if pressed is not None and pressed.moves(p.name)]
        self._colored = [k for k, p in enumerate(crowd.props) if p in colored and only in (None, p.name)]
        self._plain = [k for k, p in enumerate(crowd.props) if k not in self._colored and only in (None, p.name)]
        faces, start = [], 0
        self._refined: list[RefinedSurface] = []
        shown = [(role.actor.name, role.covering.surface.faces, span.stop - span.start) for role, span in self._roles]
        things = [crowd.props[k] for k in self._colored]
        shown += [(prop.name, prop.thing.faces, len(prop.thing.vertices)) for prop in things]
        for name, triangles, count in shown:
            surface = self._surface(name, triangles, count)
            self._refined.append(surface)
            faces.append(self._of_digits(name, surface, digits) + start)
            start += count + len(surface.edges)
        if not faces:  # an obstacle alone has no pressure of its own: shown with zero pressure
            prop = crowd.props[self._plain[0]]
            self._refined = [self._surface(prop.name, prop.thing.faces, len(prop.thing.vertices))]
            faces, self._colored, self._plain = [prop.thing.faces], self._plain[:1], []
        self._faces = np.concatenate(faces).astype(np.int32)
        self._scale = render.ColorScale.of_pressure(0.0 if pressed is None else pressed.high)

    @property
    def faces(self) -> NDArray[np.int32]:
        """Triangles of the coloured surface, over the vertices that ``at`` returns, shape (T, 3)."""
        return self._faces

    @property
    def scale(self) -> render.ColorScale:
        """Colour scale of pressures [Pa]."""
        return self._scale

    @property
    def plain(self) -> list[Prop]:
        """Objects that are drawn in their own colour."""
        return [self.crowd.props[k] for k in self._plain]

    def stage(
        self,
        camera: render.Camera,
        size: tuple[int, int],
        quality: render.Quality,
        shift: NDArray[np.float64] | float,
    ) -> render.SceneRenderer:
        """Renderer for this view; positions are translated by ``-shift`` [m]."""
        solids = [
            render.Solid(vertices - shift, prop.thing.faces, color=prop.color)
            for prop, vertices in zip(self.plain, self.others(0), strict=True)
        ]
        return render.SceneRenderer(self._faces, camera, size=size, solids=solids, scale=self._scale, quality=quality)

    def at(self, frame: int, vertices: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Vertices (n, 3) [m] and pressures (n,) [Pa] of the coloured surface at the ``frame``-th of the frames.

        ``vertices`` are the concatenated vertices of all actors [m], shape (V, 3).
        """
        number = float(self.crowd.frames[frame])
        solids = self.crowd.solid_vertices(frame)
        shown: list[tuple[str, NDArray[np.floating]]] = []
        shown += [(role.actor.name, vertices[span]) for role, span in self._roles]
        shown += [(self.crowd.props[k].name, solids[k]) for k in self._colored]
        points = [surface.of(at) for surface, (_, at) in zip(self._refined, shown, strict=True)]
        values = [self._pressure(name, number, len(at)) for (name, _), at in zip(shown, points, strict=True)]
        return np.concatenate(points), np.concatenate(values)

    def others(self, frame: int) -> list[NDArray[np.float64]]:
        """Vertices of the objects in ``plain`` at the ``frame``-th of the frames [m]."""
        solids = self.crowd.solid_vertices(frame)
        return [solids[k] for k in self._plain]

    def _surface(self, name: str, faces: NDArray[np.int32], count: int) -> RefinedSurface:
        pressed = self.crowd.pressed
        if pressed is None:
            return refine_surface(faces, np.zeros(len(faces), dtype=bool), count)
        return pressed.refined(name, faces, count)

    def _of_digits(self, name: str, surface: RefinedSurface, digits: Sequence[str]) -> NDArray[np.int32]:
        """Faces of the chosen digits of an actor; all faces where none are chosen."""
        pressed = self.crowd.pressed
        hands = [] if pressed is None or not digits else [hand for hand in pressed.model.hands if hand.name == name]
        if not hands:
            return surface.faces
        parts = hands[0].parts
        shown = np.isin(parts.part_of, [parts.names.index(digit) for digit in digits])[parts.labels]
        whole = np.concatenate([shown, shown[surface.edges].all(axis=1)])
        return surface.faces[whole[surface.faces].all(axis=1)]

    def _pressure(self, name: str, frame: float, count: int) -> NDArray[np.float64]:
        found = None if self.crowd.pressed is None else self.crowd.pressed.pressure(name, frame)
        return np.zeros(count) if found is None else found
