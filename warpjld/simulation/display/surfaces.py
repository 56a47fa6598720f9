"""Visible surfaces of hands and objects deformed by contact, at any frame (R104)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp import Places
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.surface_offset import element_edge, facet_edge
from warpjld.simulation.display.overlap import Overlap, SurfacePart
from warpjld.simulation.display.pressure_map import PressureMap, pressure_map
from warpjld.simulation.display.refine import RefinedSurface, refine_surface
from warpjld.simulation.display.separate import (
    SeparatedSurfaces,
    VisibleSurface,
    overlaps_before,
    separate_surfaces,
)
from warpjld.simulation.display.smooth import SurfaceSmoother
from warpjld.simulation.display.uncross import SkinCrossings
from warpjld.simulation.solve.digit_loads import CRUSHING
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["DeformedSurfaces"]

_SUNKEN = 0.5
"""Largest displacement of the display correction, in element edges."""
_KEPT = 64
"""Frames whose surfaces are cached, as exports, films and objects ask for the same ones in turn."""


@dataclass(frozen=True, eq=False)
class DeformedSurfaces:
    """Visible surfaces after a contact solve.

    Attributes:
        model: The contact model.
        frames: Solved frames in order.
        covered: Surface of an actor at a frame as the covering deforms it [m], shape (V, 3).
        pushed: Objects that moved rigidly (pushed or falling) outside the contact solve: frames and placements, by
            name.
        shapes: Vertices of these in their own frame [m], by name.
    """

    model: ContactModel
    frames: Sequence[SolvedFrame]
    covered: Callable[[str, float], NDArray[np.floating]]
    pushed: Mapping[str, tuple[NDArray[np.float64], Sequence[Places]]] = field(default_factory=dict)
    shapes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    _latest: dict[float, tuple[dict[str, VisibleSurface], SeparatedSurfaces]] = field(
        default_factory=dict, init=False, repr=False
    )

    def moves(self, name: str) -> bool:
        """Whether an object's surface comes from the contact solve or a rigid motion before or after it."""
        return name in self.pushed or (any(one.name == name for one in self.model.objects) and len(self.frames) > 0)

    def skin(self, actor: str, frame: float) -> NDArray[np.float64] | None:
        """Surface of an actor at a frame [m], shape (V, 3); None outside the solved frames."""
        if not any(hand.name == actor for hand in self.model.hands) or self._displacement(frame) is None:
            return None
        return self.separated(frame).vertices[actor]

    def object(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """Surface of an object at a frame [m], shape (V, 3); None outside the solved frames and rigid motions."""
        if any(one.name == name for one in self.model.objects) and self._displacement(frame) is not None:
            return self.separated(frame).vertices[name]
        frames, places = self.pushed.get(name, (np.empty(0), ()))
        if not len(frames) or frame < frames[0]:
            return None
        k = min(int(np.searchsorted(frames, frame - 1e-9)), len(frames) - 1)  # after the last frame it stays there
        return np.asarray(places[k].apply(self.shapes[name])[0])

    def refined(self, name: str, faces: NDArray[np.int32], count: int) -> RefinedSurface:
        """Surface of an actor or object, refined where it is ever in contact.

        Args:
            name: Name of the actor or object.
            faces: Its triangles, shape (T, 3).
            count: Number of its vertices.
        """
        if name in self._maps:
            return self._maps[name][0]
        return refine_surface(faces, np.zeros(len(faces), dtype=bool), count)

    def pressure(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """Contact pressure at the vertices of the refined surface of an actor or object [Pa], shape (V,); None if not
        known. Its integral over the surface is the normal force."""
        whole = self._between(self._forces, frame)
        if name not in self._maps or whole is None:
            return None
        surface, spread = self._maps[name]
        return spread.of(whole[self.model.spans[name]], surface.of(self.separated(frame).vertices[name]))

    def carried(self, frame: float) -> dict[str, VisibleSurface]:
        """Visible surfaces at a frame as embedded in the bodies, before the display correction, by name."""
        return self._surfaces(frame)[0]

    def separated(self, frame: float) -> SeparatedSurfaces:
        """Visible surfaces at a frame after the display correction."""
        return self._surfaces(frame)[1]

    def overlaps(self, frame: float, deeper: Callable[[str], float]) -> dict[tuple[SurfacePart, SurfacePart], Overlap]:
        """Overlaps at a frame after the display correction; none if no overlap of a surface is deeper than a depth [m]
        before it, which the correction only makes less."""
        if frame not in self._latest:
            moved = self._displacement(frame)
            assert moved is not None
            before = overlaps_before(self._visible(frame, moved), self.model.obstacles, frame - self.model.start)
            if all(found.depth <= deeper(one.surface) for (one, _), found in before.items()):
                return {}
        return self.separated(frame).inside

    def most(self, name: str) -> float:
        """Largest displacement of a surface's vertices by the display correction [m]."""
        body = self.model.named(name)
        return _SUNKEN * element_edge(body.mesh, body.faces)

    def _surfaces(self, frame: float) -> tuple[dict[str, VisibleSurface], SeparatedSurfaces]:
        if frame not in self._latest:
            moved = self._displacement(frame)
            assert moved is not None
            shown = self._visible(frame, moved)
            if len(self._latest) >= _KEPT:
                self._latest.pop(next(iter(self._latest)))
            apart = separate_surfaces(shown, self.model.obstacles, frame - self.model.start)
            self._latest[frame] = shown, apart
        return self._latest[frame]

    def _visible(self, frame: float, moved: NDArray[np.float64]) -> dict[str, VisibleSurface]:
        """Embedded surfaces under a displacement of all nodes (N, 3); the change of skin by flesh is smoothed."""
        skins = {hand.name: np.asarray(self.covered(hand.name, frame), dtype=np.float64) for hand in self.model.hands}
        out = {}
        for body in self.model.bodies:
            name, covered = body.name, skins.get(body.name)
            own = moved[self.model.spans[name]]
            plain = at = body.deformed(own, covered)
            if isinstance(body, FleshBody) and covered is not None:
                at = body.shown(own, covered, frame - self.model.start, self._smoothers[name].of)
            out[name] = VisibleSurface(
                at,
                body.triangles,
                body.modulus,
                self.most(name),
                body.parts,
                body.pressing,
                self._crossings.get(name),
                () if covered is None else (plain, covered),
            )
        return out

    @cached_property
    def high(self) -> float:
        """Top of the colour scale [Pa]: highest nodal pressure of all frames, as in the table, but at most the crushing
        pressure, so that one crushed digit does not wash out all others."""
        return min(CRUSHING, max((float(frame.pressure(self.model).max()) for frame in self.frames), default=0.0))

    @cached_property
    def _maps(self) -> dict[str, tuple[RefinedSurface, PressureMap]]:
        """Refined surfaces and pressure maps by name; empty if no frame was solved."""
        if not self.frames:
            return {}
        force = self._forces.max(axis=0)
        return {body.name: pressure_map(body, force[self.model.spans[body.name]]) for body in self.model.bodies}

    @cached_property
    def _smoothers(self) -> dict[str, SurfaceSmoother]:
        """Smoothers of the actors' surfaces by name."""
        return {
            hand.name: SurfaceSmoother(hand.surface, hand.triangles, element_edge(hand.mesh, hand.faces))
            for hand in self.model.hands
        }

    @cached_property
    def _crossings(self) -> dict[str, SkinCrossings]:
        """What finds crossings of the skin of actors whose flesh touches itself, by name."""
        return {
            hand.name: SkinCrossings(
                hand.triangles,
                hand.hand.surface.vertices,
                max(element_edge(hand.mesh, hand.faces), 2.0 * facet_edge(hand.surface, hand.triangles)),
                hand.embedded & (hand.shape.blend > 0.0),
                self._smoothers[hand.name],
            )
            for hand in self.model.hands
            if hand.touches_itself
        }

    @cached_property
    def _forces(self) -> NDArray[np.float64]:
        """Normal forces on the nodes at the start (zero) and at the solved frames [N], shape (1 + F, N)."""
        unloaded = np.zeros((1, len(self.model.body.mesh.nodes)))
        return np.concatenate([unloaded, *(f.nodal_contact.force.sum(axis=0)[None] for f in self.frames)])

    @cached_property
    def _displacements(self) -> NDArray[np.float64]:
        at_rest = np.zeros((1, len(self.model.body.mesh.nodes), 3))
        return np.concatenate([at_rest, *(f.displacement[None] for f in self.frames)])

    def _displacement(self, frame: float) -> NDArray[np.float64] | None:
        """Displacements of all nodes at a frame: of what falls along its path, else linear between solved frames."""
        moved, time = self._between(self._displacements, frame), frame - self.model.start
        if moved is None:
            return None
        for one in self.model.objects:
            if (fall := one.falling(time)) is not None:
                moved[self.model.spans[one.name]] = one.carried_by(fall, time)
        return moved

    def _between(self, values: NDArray[np.float64], frame: float) -> NDArray[np.float64] | None:
        """Values at a frame, linear between solved frames; None outside them."""
        times = np.array([self.model.start, *(one.frame for one in self.frames)])
        if not times[0] <= frame <= times[-1] or len(times) == 1:
            return None
        after = int(np.clip(np.searchsorted(times, frame), 1, len(times) - 1))
        part = (frame - times[after - 1]) / (times[after] - times[after - 1])
        return np.asarray((1.0 - part) * values[after - 1] + part * values[after])
