"""Skin and objects as contact deforms them, at any frame (R104)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp import Places
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.surface_offset import element_edge
from warpjld.simulation.display.pressure_map import PressureMap, pressure_map
from warpjld.simulation.display.refine import RefinedSurface, refine_surface
from warpjld.simulation.display.separate import SeparatedSurfaces, VisibleSurface, separate_surfaces
from warpjld.simulation.display.smooth import SurfaceSmoother
from warpjld.simulation.solve.digit_loads import CRUSHING
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["DeformedSurfaces"]

_SUNKEN = 0.5
"""How deep in one another visible surfaces may come to be shown apart, in edges of elements."""
_KEPT = 64
"""Frames whose surfaces are kept: exports, films and objects ask for the same ones in turn."""


@dataclass(frozen=True, eq=False)
class DeformedSurfaces:
    """What a contact solve makes of the visible surfaces.

    Attributes:
        model: What was pressed.
        frames: Those that were solved, in order.
        covered: An actor's surface at a frame as the covering has it [m], shape (V, 3).
        pushed: Objects that were pushed about before: frames and placements, by name.
        shapes: Their vertices in their own frame [m].
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
        """Whether an object is shown as contact has it, or as it falls."""
        return name in self.pushed or (any(one.name == name for one in self.model.objects) and len(self.frames) > 0)

    def skin(self, actor: str, frame: float) -> NDArray[np.float64] | None:
        """An actor's surface (V, 3) at a frame; None where contact was not solved."""
        if not any(hand.name == actor for hand in self.model.hands) or self._displacement(frame) is None:
            return None
        return self.separated(frame).vertices[actor]

    def object(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """An object's surface (V, 3) at a frame; None where contact was not solved."""
        if any(one.name == name for one in self.model.objects) and self._displacement(frame) is not None:
            return self.separated(frame).vertices[name]
        frames, places = self.pushed.get(name, (np.empty(0), ()))
        if not len(frames) or frame < frames[0]:
            return None
        k = min(int(np.searchsorted(frames, frame - 1e-9)), len(frames) - 1)  # what has fallen stays there
        return np.asarray(places[k].apply(self.shapes[name])[0])

    def refined(self, name: str, faces: NDArray[np.int32], count: int) -> RefinedSurface:
        """An actor's or object's surface, with triangles split where anything ever presses on them.

        Args:
            name: Of the actor or object.
            faces: Its triangles, shape (T, 3).
            count: Its vertices.
        """
        if name in self._maps:
            return self._maps[name][0]
        return refine_surface(faces, np.zeros(len(faces), dtype=bool), count)

    def pressure(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """Contact pressure on an actor or object [Pa], at the vertices of its refined surface, shape (V,); None where
        there is none. Its integral over the surface is the force that presses."""
        whole = self._between(self._forces, frame)
        if name not in self._maps or whole is None:
            return None
        surface, spread = self._maps[name]
        return spread.of(whole[self.model.spans[name]], surface.of(self.separated(frame).vertices[name]))

    def carried(self, frame: float) -> dict[str, VisibleSurface]:
        """Visible surfaces at a frame that was solved, or between two, as bodies carry them, by name."""
        return self._surfaces(frame)[0]

    def separated(self, frame: float) -> SeparatedSurfaces:
        """The same without overlap."""
        return self._surfaces(frame)[1]

    def most(self, name: str) -> float:
        """How far vertices of a surface may be moved to be shown apart from others [m]."""
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
        """Surfaces under a displacement of all nodes (N, 3); what flesh does to skin is smoothed."""
        skins = {hand.name: np.asarray(self.covered(hand.name, frame), dtype=np.float64) for hand in self.model.hands}
        out = {}
        for body in self.model.bodies:
            name, covered = body.name, skins.get(body.name)
            at = body.deformed(moved[self.model.spans[name]], covered)
            if covered is not None:
                at = covered + self._smoothers[name].of(at - covered)
            out[name] = VisibleSurface(at, body.triangles, body.modulus, self.most(name), body.parts, body.pressing)
        return out

    @cached_property
    def high(self) -> float:
        """Highest pressure at any node and any frame that was solved [Pa]: as the table has it, and no more than what
        crushes flesh, so that what one digit is crushed with does not blank all others."""
        return min(CRUSHING, max((float(frame.pressure(self.model).max()) for frame in self.frames), default=0.0))

    @cached_property
    def _maps(self) -> dict[str, tuple[RefinedSurface, PressureMap]]:
        """Refined surfaces, and how forces on nodes are spread over them, by name; none where nothing was solved."""
        if not self.frames:
            return {}
        force = self._forces.max(axis=0)
        return {body.name: pressure_map(body, force[self.model.spans[body.name]]) for body in self.model.bodies}

    @cached_property
    def _smoothers(self) -> dict[str, SurfaceSmoother]:
        """Of the actors' surfaces, by name."""
        return {
            hand.name: SurfaceSmoother(hand.surface, hand.triangles, element_edge(hand.mesh, hand.faces))
            for hand in self.model.hands
        }

    @cached_property
    def _forces(self) -> NDArray[np.float64]:
        """What presses on the nodes, at the start and at the frames that were solved [N]."""
        nothing = np.zeros((1, len(self.model.body.mesh.nodes)))
        return np.concatenate([nothing, *(f.nodal_contact.force.sum(axis=0)[None] for f in self.frames)])

    @cached_property
    def _displacements(self) -> NDArray[np.float64]:
        nothing = np.zeros((1, len(self.model.body.mesh.nodes), 3))
        return np.concatenate([nothing, *(f.displacement[None] for f in self.frames)])

    def _displacement(self, frame: float) -> NDArray[np.float64] | None:
        return self._between(self._displacements, frame)

    def _between(self, values: NDArray[np.float64], frame: float) -> NDArray[np.float64] | None:
        """Values at a frame: straight between two that were solved, None outside."""
        times = np.array([self.model.start, *(one.frame for one in self.frames)])
        if not times[0] <= frame <= times[-1] or len(times) == 1:
            return None
        after = int(np.clip(np.searchsorted(times, frame), 1, len(times) - 1))
        part = (frame - times[after - 1]) / (times[after] - times[after - 1])
        return np.asarray((1.0 - part) * values[after - 1] + part * values[after])
