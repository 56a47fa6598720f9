"""Rigid-body fall of unsupported objects until they rest or hands hold them by friction (R139).

Contact of deformable bodies is solved quasi-statically, and a falling object has no equilibrium. So an object with
weight that no hand holds and no Dirichlet condition constrains is integrated as a rigid body (``simulation.fall``)
frame by frame. The quasi-static solve starts when it rests or is held.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.meshes import Keyframed
from warpjld.grasp import Places
from warpjld.simulation.animation import Animation
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.time_stepping import step_bodies, steps_of
from warpjld.simulation.solve.friction_closure import friction_closure
from warpjld.simulation.specification import ContactSpecification, SolveSpecification

__all__ = ["FallPath", "falling_names", "follow_falls"]

_STILL = 1e-2
"""Speed below which a body may be at rest [m/s]."""
_QUIET = 0.25
"""Time for which it must be slower than that [s]."""
_CLOSE = 0.01
"""Margin of the bounding boxes within which an actor counts as near a body [m]."""
_PRESSED = 2e-4
"""Depth of skin inside an object from which it counts as pressing on it [m]."""
_MOVED = 2e-4
"""Displacement from which a fall is reported [m]; less is the settling of an object at rest."""


@dataclass(eq=False)
class FallPath:
    """Path of a free object.

    Attributes:
        name: Name of the object.
        frames: Frame numbers, ascending.
        places: Placements at these frames.
        rests: Frame from which on it rests; None: it still moves at the last frame.
        on: Names of what it rests on.
        left: Frame at which it is below everything it could fall on; None if it never is.
        held: Frame at which hands hold it; None if they never do.
        speed: Speed at the last frame [m/s].
    """

    name: str
    frames: list[float]
    places: list[Places]
    rests: float | None = None
    on: tuple[str, ...] = ()
    left: float | None = None
    held: float | None = None
    speed: float = 0.0

    def at(self, frame: float) -> Places:
        """Placement at a frame, interpolated; constant before the first and after the last frame."""
        k = int(np.clip(np.searchsorted(self.frames, frame + 1e-9) - 1, 0, len(self.frames) - 1))
        if k + 1 == len(self.frames) or frame <= self.frames[k]:
            return self.places[k]
        part = (frame - self.frames[k]) / (self.frames[k + 1] - self.frames[k])
        one, two = self.places[k], self.places[k + 1]
        turn = two.rotation * (np.sign(float(one.rotation[0] @ two.rotation[0])) or 1.0)
        return Places.of((1.0 - part) * one.position + part * two.position, (1.0 - part) * one.rotation + part * turn)

    @property
    def distance(self) -> float:
        """Largest distance from its first position [m]."""
        first = self.places[0].position
        return max(float(np.linalg.norm(place.position - first)) for place in self.places)

    def summary(self) -> str:
        """``BALL … falls from frame 0 on, and comes to rest on BOWL at frame 61``; empty if it did not fall."""
        if self.distance < _MOVED and self.rests is not None:
            return ""
        begun = f"{self.name} is held by nothing: it falls from frame {self.frames[0]:g} on"
        if self.left is not None:
            return f"{begun}, and leaves the stage at frame {self.left:g}: nothing is below it"
        if self.held is not None:
            return f"{begun}, until it is held at frame {self.held:g}"
        if self.rests is not None:
            return f"{begun}, and comes to rest on {' and '.join(self.on)} at frame {self.rests:g}"
        return f"{begun}, and still moves at frame {self.frames[-1]:g} at {self.speed:.2g} m/s: see FRAMES"


def falling_names(contact: ContactSpecification, request: SolveSpecification) -> list[str]:
    """Deformable objects with weight and without Dirichlet conditions, bonds, loads or a grip that lifts them."""
    if request.method == "paper" or not any(contact.pull):
        return []
    stands = {name for name, _ in contact.prescribed} | {grip.object for grip in contact.grips if grip.lift}
    stands |= {name for bond in contact.bonds for name in (bond.one, bond.other)}
    stands |= contact.loaded
    return [name for name, matter in contact.physical.items() if name not in stands and matter.density > 0.0]


def follow_falls(
    animation: Animation,
    contact: ContactSpecification,
    request: SolveSpecification,
    names: Sequence[str],
    *,
    released: Mapping[str, RigidBody] | None = None,
    first: float | None = None,
) -> dict[str, FallPath]:
    """Fall paths of free objects, each until the last frame or until hands hold it.

    Args:
        animation: Motion of everything else.
        contact: Specification with friction, weights and actors with flesh.
        request: Frames and frame rate.
        names: Names of the free objects.
        released: Rigid bodies at the ``first`` frame, for objects that hands have released; hands then no longer hold
            them.
        first: First frame; by default the request's.
    """
    stage = _Stage(animation, contact, request, float(request.first) if first is None else first, bool(released))
    for name in names:
        one = animation.objects[name]
        body = None if released is None else released.get(name)
        stage.add(body or RigidBody(rigid_shape(name, one.thing, contact.physical[name]), one.place(stage.start)))
    return stage.followed()


@dataclass(eq=False)
class _Stage:
    """Falling bodies, with everything else as obstacles; times of obstacles are in frames from ``start``."""

    animation: Animation
    contact: ContactSpecification
    request: SolveSpecification
    start: float
    released: bool = False
    bodies: dict[str, RigidBody] = field(default_factory=dict)
    paths: dict[str, FallPath] = field(default_factory=dict)
    quiet: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Slow bodies: frame since when, and for how long [s]."""

    def add(self, body: RigidBody) -> None:
        """Add an object that falls from the start frame on."""
        self.bodies[body.shape.name] = body
        self.paths[body.shape.name] = FallPath(body.shape.name, [self.start], [body.place])

    def followed(self) -> dict[str, FallPath]:
        """Integrate frame by frame until all bodies rest, are held or have left the scene."""
        solids = {
            name: one.obstacle(self.start) for name, one in self.animation.objects.items() if name not in self.bodies
        }
        self._hold(self.start, solids)
        frame = self.start
        while frame < self.request.last and self._moving():
            self._frame(frame, min(frame + 1.0, float(self.request.last)), solids)
            frame += 1.0
            self._hold(frame, solids)
        for name, path in self.paths.items():
            body = self.bodies.get(name)
            if body is not None and path.rests is None and path.left is None:
                path.speed = body.speed
        return self.paths

    def _moving(self) -> bool:
        """Whether any body still moves; bodies at rest stay in the simulation, as they may be hit."""
        return any(self.paths[name].rests is None for name in self.bodies)

    def _frame(self, before: float, after: float, solids: Mapping[str, Obstacle]) -> None:
        """Integrate from one frame to the next."""
        rate, gravity = self.request.rate, np.array(self.contact.pull, np.float64)
        count = steps_of(after - before, rate)
        step = (after - before) / count
        around = {**solids, **self._skins(before, after)}
        for k in range(count):
            names = list(self.bodies)
            now = before + k * step
            step_bodies(
                list(self.bodies.values()),
                around,
                gravity,
                self.contact.coefficient,
                time=now - self.start,
                step=step,
                length=step / rate,
            )
            for name in names:
                self._note(name, now + step, step / rate)
        for name in list(self.bodies):
            path, body = self.paths[name], self.bodies[name]
            path.frames.append(after)
            path.places.append(body.place)
            if self._lost(body, solids, after):
                path.left = after
                del self.bodies[name]

    def _note(self, name: str, frame: float, length: float) -> None:
        """Update whether a body is at rest: slow for long enough, which it cannot be in the air."""
        body, path = self.bodies[name], self.paths[name]
        if body.touching:
            path.on = body.touching
        if body.speed > _STILL:
            self.quiet.pop(name, None)
            path.rests = None
            return
        since, long = self.quiet.get(name, (frame - length * self.request.rate, 0.0))
        self.quiet[name] = since, long + length
        if long + length >= _QUIET and path.rests is None:
            path.rests = float(np.ceil(since - 1e-6))

    def _skins(self, before: float, after: float) -> dict[str, Obstacle]:
        """Surfaces of actors near any body between two frames, as keyframed obstacles by name."""
        out: dict[str, Obstacle] = {}
        for name, actor in self.animation.actors.items():
            shapes = np.stack([actor.skin(before), actor.skin(after)])
            if not any(_meet(shapes, body, (after - before) / self.request.rate) for body in self.bodies.values()):
                continue
            times = [before - self.start, after - self.start]
            out[name] = Keyframed(actor.covering.surface.faces, times, shapes)
        return out

    def _lost(self, body: RigidBody, solids: Mapping[str, Obstacle], frame: float) -> bool:
        """Whether a body is below everything else, so that nothing can stop it."""
        down = np.array(self.contact.pull) / np.linalg.norm(self.contact.pull)
        others = [solid.mesh(frame - self.start)[0] for solid in solids.values()]
        others += [actor.skin(frame) for actor in self.animation.actors.values()]
        others += [one.points for one in self.bodies.values() if one is not body]
        others.append(self.paths[body.shape.name].places[0].position)
        return float((body.points @ down).min()) > max(float((points @ down).max()) for points in others)

    def _hold(self, frame: float, solids: dict[str, Obstacle]) -> None:
        """Turn bodies that hands hold by friction into fixed obstacles for the others."""
        if self.released:
            return
        skins = {name: self.animation.actors[name].skin(frame) for name in self.contact.flesh}
        for name in list(self.bodies) if skins else []:
            body = self.bodies[name]
            points = np.concatenate(list(skins.values()))
            near = points[np.linalg.norm(points - body.centre, axis=1) < body.shape.reach]
            if len(near) < 2:
                continue
            found = body.project(near)
            inside = found.distance < -_PRESSED
            friction = min(self.contact.coefficient(name, actor) for actor in skins)
            if friction_closure(near[inside], -found.normal[inside], -found.distance[inside], friction):
                self.paths[name].held = frame
                facets = body.shape.facets
                shape = body.stage(facets.vertices)
                solids[name] = Keyframed(facets.faces, [0.0], shape[None])
                del self.bodies[name]


def _meet(shapes: NDArray[np.float64], body: RigidBody, length: float) -> bool:
    """Whether the box of a surface at two times (2, V, 3) comes near a body that falls for ``length`` seconds."""
    reach = body.shape.reach + length * (body.speed + 9.81 * length) + _CLOSE  # free fall at 9.81 m/s²
    low, high = shapes.min(axis=(0, 1)) - reach, shapes.max(axis=(0, 1)) + reach
    return bool((body.centre > low).all() and (body.centre < high).all())
