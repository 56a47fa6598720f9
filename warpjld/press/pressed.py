"""Skin and objects as contact deforms them, at any frame (R104)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.grasp import Places
from warpjld.press.bodies import Bodies
from warpjld.press.clear import Cleared, Shown, clear
from warpjld.press.finer import Finer, finer
from warpjld.press.hand_body import WORN
from warpjld.press.outside import outer_triangles
from warpjld.press.pressure_map import PressureMap, pressure_map
from warpjld.press.run import Solved
from warpjld.press.smooth import Smoother

__all__ = ["Pressed"]

_SUNKEN = 0.5
"""How deep in one another visible surfaces may come to be shown apart, in edges of elements."""
_KEPT = 64
"""Frames whose surfaces are kept: exports, films and objects ask for the same ones in turn."""


@dataclass(frozen=True, eq=False)
class Pressed:
    """What a contact solve makes of the visible surfaces.

    Attributes:
        bodies: What was pressed.
        solved: What came of it.
        covered: An actor's surface at a frame as the covering has it [m], shape (V, 3).
        pushed: Objects that were pushed about before: frames and placements, by name.
        shapes: Their vertices in their own frame [m].
    """

    bodies: Bodies
    solved: Solved
    covered: Callable[[str, float], NDArray[np.floating]]
    pushed: Mapping[str, tuple[NDArray[np.float64], Sequence[Places]]] = field(default_factory=dict)
    shapes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    _latest: dict[float, tuple[dict[str, Shown], Cleared]] = field(default_factory=dict, init=False, repr=False)

    def moves(self, name: str) -> bool:
        """Whether an object is shown as contact has it."""
        return any(one.name == name for one in self.bodies.objects) and len(self.solved.frames) > 0

    def skin(self, actor: str, frame: float) -> NDArray[np.float64] | None:
        """An actor's surface (V, 3) at a frame; None where contact was not solved."""
        if not any(hand.name == actor for hand in self.bodies.hands) or self._displacement(frame) is None:
            return None
        return self.cleared(frame).vertices[actor]

    def object(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """An object's surface (V, 3) at a frame; None where contact was not solved."""
        one = next((o for o in self.bodies.objects if o.name == name), None)
        moved = self._displacement(frame)
        if one is None:
            return None
        if moved is None:
            frames, places = self.pushed.get(name, (np.empty(0), ()))
            if not len(frames) or not frames[0] <= frame <= frames[-1]:
                return None
            return np.asarray(places[int(np.searchsorted(frames, frame))].apply(self.shapes[name])[0])
        return self.cleared(frame).vertices[name]

    def finer(self, name: str, faces: NDArray[np.int32], count: int) -> Finer:
        """An actor's or object's surface, with triangles split where anything ever presses on them.

        Args:
            name: Of the actor or object.
            faces: Its triangles, shape (T, 3).
            count: Its vertices.
        """
        return self._maps[name][0] if name in self._maps else finer(faces, np.zeros(len(faces), dtype=bool), count)

    def pressure(self, name: str, frame: float) -> NDArray[np.float64] | None:
        """Contact pressure on an actor or object [Pa], at the vertices of its finer surface, shape (V,); None where
        there is none. Its integral over the surface is the force that presses."""
        whole = self._between(self._forces, frame)
        if name not in self._maps or whole is None:
            return None
        surface, spread = self._maps[name]
        return spread.of(whole[self.bodies.spans[name]], surface.of(self.cleared(frame).vertices[name]))

    def shown(self, frame: float) -> dict[str, Shown]:
        """Visible surfaces at a frame that was solved, or between two, as they are carried, by name."""
        return self._surfaces(frame)[0]

    def cleared(self, frame: float) -> Cleared:
        """The same without overlap."""
        return self._surfaces(frame)[1]

    def most(self, name: str) -> float:
        """How far vertices of a surface may be moved to be shown apart from others [m]."""
        for hand in self.bodies.hands:
            if hand.name == name:
                return _SUNKEN * _edge(hand.part.hand.mesh, hand.part.hand.name)
        volume = next(one.volume for one in self.bodies.objects if one.name == name)
        return _SUNKEN * _edge(volume.mesh, volume.name)

    def _surfaces(self, frame: float) -> tuple[dict[str, Shown], Cleared]:
        if frame not in self._latest:
            moved = self._displacement(frame)
            assert moved is not None
            spans = self.bodies.spans
            shown: dict[str, Shown] = {}
            for hand in self.bodies.hands:
                faces, most = hand.part.hand.surface.faces, self.most(hand.name)
                covered = np.asarray(self.covered(hand.name, frame), dtype=np.float64)
                skin = hand.part.worn(moved[spans[hand.name]], covered)
                skin = covered + self._smoothers[hand.name].of(skin - covered)
                presses = (hand.part.blend > WORN) & hand.itself
                shown[hand.name] = Shown(skin, faces, hand.softness, most, hand.parts, presses)
            for one in self.bodies.objects:
                volume = one.volume
                surface = volume.worn(moved[spans[one.name]])
                shown[one.name] = Shown(surface, volume.faces, volume.physical.young, self.most(one.name))
            if len(self._latest) >= _KEPT:
                self._latest.pop(next(iter(self._latest)))
            self._latest[frame] = shown, clear(shown, self.bodies.obstacles, frame - self.solved.start)
        return self._latest[frame]

    @cached_property
    def high(self) -> float:
        """Highest pressure at any node and any frame that was solved [Pa]: as the table has it."""
        return max((float(frame.pressure(self.bodies).max()) for frame in self.solved.frames), default=0.0)

    @cached_property
    def _maps(self) -> dict[str, tuple[Finer, PressureMap]]:
        """Finer surfaces, and how forces on nodes are spread over them, by name; none where nothing was solved."""
        if not len(self._frames):
            return {}
        force = self._forces.max(axis=0)
        out = {}
        for hand in self.bodies.hands:
            part, flesh = hand.part, hand.part.hand
            push = force[self.bodies.spans[hand.name]]
            out[hand.name] = pressure_map(
                flesh.mesh, flesh.name, flesh.flesh.skin, part.skin, flesh.surface.faces, push, part.blend > 0.0
            )
        for one in self.bodies.objects:
            volume, push = one.volume, force[self.bodies.spans[one.name]]
            out[one.name] = pressure_map(volume.mesh, volume.name, volume.visible, volume.surface, volume.faces, push)
        return out

    @cached_property
    def _smoothers(self) -> dict[str, Smoother]:
        """Of the visible surfaces, by name."""
        out = {}
        for hand in self.bodies.hands:
            flesh = hand.part.hand
            out[hand.name] = Smoother(hand.part.skin, flesh.surface.faces, _edge(flesh.mesh, flesh.name))
        for one in self.bodies.objects:
            volume = one.volume
            out[one.name] = Smoother(volume.surface, volume.faces, _edge(volume.mesh, volume.name))
        return out

    @cached_property
    def _frames(self) -> NDArray[np.float64]:
        return np.array([frame.frame for frame in self.solved.frames])

    @cached_property
    def _forces(self) -> NDArray[np.float64]:
        """What presses on the nodes, at the start and at the frames that were solved [N]."""
        nothing = np.zeros((1, len(self.bodies.body.mesh.nodes)))
        return np.concatenate([nothing, *(f.nodal_contact.force.sum(axis=0)[None] for f in self.solved.frames)])

    @cached_property
    def _displacements(self) -> NDArray[np.float64]:
        nothing = np.zeros((1, len(self.bodies.body.mesh.nodes), 3))
        return np.concatenate([nothing, *(f.displacement[None] for f in self.solved.frames)])

    def _displacement(self, frame: float) -> NDArray[np.float64] | None:
        return self._between(self._displacements, frame)

    def _between(self, values: NDArray[np.float64], frame: float) -> NDArray[np.float64] | None:
        """Values at a frame: straight between two that were solved, None outside."""
        times = np.concatenate([[self.solved.start], self._frames])
        if not times[0] <= frame <= times[-1] or len(times) == 1:
            return None
        after = int(np.clip(np.searchsorted(times, frame), 1, len(times) - 1))
        part = (frame - times[after - 1]) / (times[after] - times[after - 1])
        return np.asarray((1.0 - part) * values[after - 1] + part * values[after])


def _edge(mesh: HexMesh, faces: str) -> float:
    """Median edge of a face set at rest [m]."""
    nodes, triangles = outer_triangles(mesh, faces)
    x = mesh.nodes[nodes[triangles]]
    return float(np.median(np.linalg.norm(x[:, 1] - x[:, 0], axis=1)))
