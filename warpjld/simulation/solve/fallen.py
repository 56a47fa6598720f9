"""What is asked of contact once free objects have fallen: from where, and which of them take part (R139)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.grasp import GraspObject, Places
from warpjld.simulation.animation import ActorAnimation, AngleEdit, Animation, ObjectAnimation
from warpjld.simulation.bodies.obstacle import rigid_obstacle
from warpjld.simulation.solve.falling import FallPath
from warpjld.simulation.specification import ContactSpecification

if TYPE_CHECKING:
    from warpjld.simulation.solve.start_frame import StartFrame

__all__ = ["FallenAnimation", "FallenObject", "fallen_start", "moved_by", "taking_part", "without"]


@dataclass(frozen=True, eq=False)
class FallenObject:
    """An object on its path, as a simulation asks for it."""

    name: str
    thing: GraspObject
    path: FallPath

    def place(self, frame: float) -> Places:
        """Where it is."""
        return self.path.at(frame)

    def obstacle(self, start: float) -> Obstacle:
        """It as something that does not give way; the obstacle's time is in frames from ``start``."""

        def motion(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            here = self.path.at(start + time)
            return here.position[0], here.rotation[0]

        return rigid_obstacle(self.thing, motion)


class FallenAnimation:
    """An animation in which some objects go where they fall."""

    def __init__(self, animation: Animation, paths: Mapping[str, FallPath]) -> None:
        self._animation, self._paths = animation, paths
        fallen = {name: FallenObject(name, animation.objects[name].thing, path) for name, path in paths.items()}
        self._objects: dict[str, ObjectAnimation] = {**animation.objects, **fallen}

    @property
    def actors(self) -> Mapping[str, ActorAnimation]:
        """As they were."""
        return self._animation.actors

    @property
    def objects(self) -> Mapping[str, ObjectAnimation]:
        """In their order on the stage."""
        return self._objects

    def edited(self, edits: Sequence[AngleEdit]) -> FallenAnimation:
        """The same with edits laid over its actors; what falls stays the same object."""
        out = FallenAnimation(self._animation.edited(edits), self._paths)
        out._objects |= {name: self._objects[name] for name in self._paths}
        return out


def fallen_start(paths: Mapping[str, FallPath], first: float, last: float) -> float:
    """Frame from which on contact is solved with what has fallen: when all rest, or before the first is held."""
    held = [path.held for path in paths.values() if path.held is not None]
    if held:
        return max(first, np.ceil(min(held)) - 1.0)
    return max((path.rests for path in paths.values() if path.rests is not None), default=last)


def without(contact: ContactSpecification, names: Sequence[str]) -> ContactSpecification:
    """The same in which some objects do not deform."""
    physical = {name: matter for name, matter in contact.physical.items() if name not in names}
    return replace(contact, physical=physical)


def taking_part(paths: Mapping[str, FallPath], start: float) -> list[str]:
    """Objects that rest at a frame, or are held."""
    return [
        name
        for name, path in paths.items()
        if path.left is None and (path.held is not None or (path.rests is not None and path.rests <= start))
    ]


def moved_by(paths: Mapping[str, FallPath], before: StartFrame, inside: Sequence[str]) -> StartFrame:
    """The start of contact, with the ways of what fell: up to the start of what takes part, all of the others'."""
    moved = dict(before.moved)
    for name, path in paths.items():
        end = before.start if name in inside else np.inf
        rows = [k for k, frame in enumerate(path.frames) if frame < end]
        frames, places = [path.frames[k] for k in rows], [path.places[k] for k in rows]
        if name in inside:
            frames, places = [*frames, before.start], [*places, path.at(before.start)]
        moved[name] = (frames, places)
    told = tuple(text for path in paths.values() if (text := path.told()))
    return replace(before, moved=moved, falls=told)
