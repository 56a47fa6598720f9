"""The stage on which free objects fall: rigid bodies, everything else as obstacles, and impacts between."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.meshes import Keyframed
from warpjld.simulation.animation import Animation
from warpjld.simulation.bodies.obstacle import placed_motion, rigid_obstacle
from warpjld.simulation.bodies.skin_obstacle import SkinObstacle
from warpjld.simulation.fall.contact_points import RigidContact
from warpjld.simulation.fall.fall_path import FallPath
from warpjld.simulation.fall.impact import Impact, solve_impact
from warpjld.simulation.fall.rigid_body import RigidBody, RigidState
from warpjld.simulation.fall.rigid_load import RigidLoad
from warpjld.simulation.fall.strike import Strike, found_strikes
from warpjld.simulation.fall.time_stepping import coast, step_bodies, steps_of
from warpjld.simulation.solve.friction_closure import friction_closure
from warpjld.simulation.specification import BondStrength, ContactSpecification, SolveSpecification

__all__ = ["FallingStage"]

_STILL = 1e-2
"""Speed below which a body may be at rest [m/s]."""
_QUIET = 0.25
"""Time for which it must be slower than that [s]."""
_CLOSE = 0.01
"""Margin of the bounding boxes within which an actor counts as near a body [m]."""
_INSIDE = 5e-4
"""Depth from which a body is said to begin inside another [m]; animators place things less exactly than that."""
_PRESSED = 2e-4
"""Depth of skin inside an object from which it counts as pressing on it [m]."""


@dataclass(eq=False)
class FallingStage:
    """Falling bodies, with everything else as obstacles; times of obstacles are in frames from ``start``.

    Attributes:
        animation: Motion of everything else.
        contact: Specification; its bonds are those that hold.
        request: Frames and frame rate.
        start: First frame.
        released: Whether hands have released the bodies, and no longer hold them.
        standing: Objects that stand elsewhere than in the animation, or deformed, by name.
        loads: External loads of its objects, by name.
        bodies: Bodies that fall, rest or move.
        paths: Paths of their objects by name.
        openings: Messages about impacts.
        interrupted: Frame after which Ctrl-C ended the falls; None if nothing did.
    """

    animation: Animation
    contact: ContactSpecification
    request: SolveSpecification
    start: float
    released: bool = False
    standing: Mapping[str, Obstacle] = field(default_factory=dict)
    loads: Mapping[str, RigidLoad] = field(default_factory=dict)
    bodies: list[RigidBody] = field(default_factory=list)
    paths: dict[str, FallPath] = field(default_factory=dict)
    openings: list[str] = field(default_factory=list)
    interrupted: float | None = None
    _quiet: dict[RigidBody, tuple[float, float]] = field(default_factory=dict)
    """Slow bodies: frame since when, and for how long [s]."""
    _impacts: list[Impact] = field(default_factory=list)
    """Impacts that are not yet over, whose objects are in no body."""
    _stiff: list[RigidBody] = field(default_factory=list)
    """Bodies with an impact that could not be solved, which strike rigidly."""

    def add(self, body: RigidBody) -> None:
        """Add a body that falls from the start frame on."""
        self.bodies.append(body)
        names = tuple(part.shape.name for part in body.parts)
        for part in body.parts:
            name = part.shape.name
            together = names if len(names) > 1 else ()
            self.paths[name] = FallPath(name, [self.start], [part.place], together=together)

    def followed(self) -> dict[str, FallPath]:
        """Integrate frame by frame until all bodies rest, are held or have left the scene. Ctrl-C ends it after the
        last whole frame, if there is one."""
        solids = {
            name: one.obstacle(self.start) for name, one in self.animation.objects.items() if name not in self.paths
        } | dict(self.standing)
        for body in self.bodies:
            self._note_overlap(body, solids)
        self._hold(self.start, solids)
        frame, known = self.start, self._known()
        try:
            while frame < self.request.last and (self._impacts or any(self._moves(body) for body in self.bodies)):
                self._frame(frame, min(frame + 1.0, float(self.request.last)), solids)
                self._hold(frame + 1.0, solids)
                frame, known = frame + 1.0, self._known()
        except KeyboardInterrupt:
            if frame == self.start:
                raise
            self.interrupted = frame
            self.paths, self.contact.bonds, self.openings = known
        for body in self.bodies:
            for path in self._paths(body):
                path.speed = body.speed if path.rests is None else 0.0
        return self.paths

    def _known(self) -> tuple[dict[str, FallPath], list[BondStrength], list[str]]:
        """Paths, bonds and messages so far; an interrupt may come at any time within the next frame."""
        paths = {
            name: replace(path, frames=list(path.frames), places=list(path.places)) for name, path in self.paths.items()
        }
        return paths, list(self.contact.bonds), list(self.openings)

    def _paths(self, body: RigidBody) -> list[FallPath]:
        return [self.paths[part.shape.name] for part in body.parts]

    def _moves(self, body: RigidBody) -> bool:
        """Whether a body still moves; bodies at rest stay in the simulation, as they may be hit."""
        return any(path.rests is None for path in self._paths(body))

    def _frame(self, before: float, after: float, solids: Mapping[str, Obstacle]) -> None:
        """Integrate from one frame to the next."""
        rate = self.request.rate
        count = steps_of(after - before, rate)
        step = (after - before) / count
        around = {**solids, **self._skins(before, after)}
        for k in range(count):
            now = before + k * step
            self._step(now, step, around, solids)
            for body in self.bodies:
                self._note(body, now + step, step / rate)
        for body in list(self.bodies):
            for part, path in zip(body.parts, self._paths(body), strict=True):
                if path.frames[-1] < after:
                    path.frames.append(after)
                    path.places.append(part.place)
            if self._lost(body, solids, after):
                for path in self._paths(body):
                    path.left = after
                self.bodies.remove(body)

    def _step(self, now: float, step: float, around: Mapping[str, Obstacle], solids: Mapping[str, Obstacle]) -> None:
        """Advance all bodies by a step [frames], and solve the impacts of those that strike hard."""
        known = {body: body.state for body in self.bodies}
        pressed = self._advanced(self.bodies, around, now, step)
        matter, bonds, pull = self.contact.physical, self.contact.bonds, np.array(self.contact.pull, np.float64)
        found = found_strikes(self.bodies, pressed, matter, bonds, pull, step / self.request.rate)
        struck = [(strike, [self.bodies[k] for k in strike.bodies]) for strike in found]
        for strike, group in struck:
            if not any(body in self._stiff for body in group):
                self._strike(strike, group, known, now, {**solids, **around})
        for impact in [one for one in self._impacts if one.end <= now + step]:
            self._impacts.remove(impact)
            self._advanced(impact.bodies, around, impact.end, now + step - impact.end)
            self.bodies += impact.bodies

    def _advanced(
        self, bodies: list[RigidBody], around: Mapping[str, Obstacle], now: float, step: float
    ) -> list[RigidContact]:
        """Advance bodies by a step [frames]; returns its contacts."""
        gravity, length = np.array(self.contact.pull, np.float64), step / self.request.rate
        timing = {"time": now - self.start, "step": step, "length": length}
        load = partial(self._load, frame=now) if self.loads else None
        return step_bodies(bodies, around, gravity, self.contact.coefficient, **timing, load=load)

    def _load(self, body: RigidBody, frame: float) -> NDArray[np.float64]:
        """External force [N] and moment about the centre of mass [N m] on a body, shape (6,)."""
        out = np.zeros(6)
        for part in body.parts:
            if (load := self.loads.get(part.shape.name)) is not None:
                found = load.at(part, frame)
                out += found
                out[3:] += np.cross(part.centre - body.centre, found[:3])
        return out

    def _strike(
        self,
        strike: Strike,
        group: list[RigidBody],
        known: Mapping[RigidBody, RigidState],
        now: float,
        around: Mapping[str, Obstacle],
    ) -> None:
        """Solve an impact of a group of bodies that were in ``known`` states before the step; what cannot be solved is
        told, and lands rigidly."""
        landed = [body.state for body in group]
        for body in group:
            body.restore(known[body])
            coast(body, np.array(self.contact.pull, np.float64), strike.wait)
        start, rate = now + strike.wait * self.request.rate, self.request.rate
        names = {part.shape.name for body in group for part in body.parts}
        obstacles = {name: self._obstacle(name, solid, start) for name, solid in around.items()}
        obstacles |= {body.shape.name: _fixed(body) for body in self.bodies if body not in group}
        found = solve_impact(group, obstacles, self.animation, self.contact, start, rate, strike)
        if isinstance(found, str):
            self._stiff += group
            title = " and ".join(body.shape.name for body in group)
            self.openings.append(
                f"the impact of {title} at frame {start:.5g} lands rigidly, as it was not solved: {found}"
            )
            for body, state in zip(group, landed, strict=True):
                body.restore(state)
            return
        others = [bond for bond in self.contact.bonds if not names.issuperset((bond.one, bond.other))]
        self.contact.bonds = [*others, *found.bonds]
        self.openings += found.openings
        for name, (frames, places) in found.paths.items():
            self.paths[name].rests = None
            self.paths[name].frames += frames
            self.paths[name].places += places
        self.bodies = [body for body in self.bodies if body not in group]
        self._impacts.append(found)

    def _obstacle(self, name: str, solid: Obstacle, start: float) -> Obstacle:
        """An obstacle of the stage with its times from another frame."""
        if name in self.animation.actors:
            return SkinObstacle(self.animation.actors[name], start)
        if name not in self.animation.objects or name in self.paths or name in self.standing:
            return solid
        one = self.animation.objects[name]
        # an impact asks for the same times again and again
        return rigid_obstacle(one.thing, lru_cache(maxsize=8)(placed_motion(one.place, start)))

    def _note(self, body: RigidBody, frame: float, length: float) -> None:
        """Update whether a body is at rest: slow for long enough, which it cannot be in the air."""
        paths = self._paths(body)
        if body.touching:
            for path in paths:
                path.on = body.bearers
        if body.speed > _STILL:
            self._quiet.pop(body, None)
            for path in paths:
                path.rests = None
            return
        since, long = self._quiet.get(body, (frame - length * self.request.rate, 0.0))
        self._quiet[body] = since, long + length
        if long + length >= _QUIET and self._moves(body):
            for path in paths:
                path.rests = max(self.start, float(np.ceil(since - 1e-6)))

    def _note_overlap(self, body: RigidBody, solids: Mapping[str, Obstacle]) -> None:
        """Note what a body begins inside of, and how deep."""
        points = body.points
        depths = {name: -float(solid.project(points, 0.0).distance.min()) for name, solid in solids.items()}
        depths |= {o.shape.name: -float(o.project(points).distance.min()) for o in self.bodies if o is not body}
        name = max(depths, key=lambda known: depths[known], default="")
        if name and depths[name] > _INSIDE:
            for path in self._paths(body):
                path.inside, path.depth = name, depths[name]

    def _skins(self, before: float, after: float) -> dict[str, Obstacle]:
        """Surfaces of actors near any body between two frames, as keyframed obstacles by name."""
        out: dict[str, Obstacle] = {}
        for name, actor in self.animation.actors.items():
            shapes = np.stack([actor.skin(before), actor.skin(after)])
            length, pull = (after - before) / self.request.rate, float(np.linalg.norm(self.contact.pull))
            gains = [
                pull + float(np.linalg.norm(self._load(body, after)[:3])) / body.shape.mass for body in self.bodies
            ]
            if not any(_meet(shapes, body, length, gain) for body, gain in zip(self.bodies, gains, strict=True)):
                continue
            times = [before - self.start, after - self.start]
            out[name] = Keyframed(actor.covering.surface.faces, times, shapes)
        return out

    def _lost(self, body: RigidBody, solids: Mapping[str, Obstacle], frame: float) -> bool:
        """Whether a body is below everything else, so that nothing can stop it."""
        down = np.array(self.contact.pull) / np.linalg.norm(self.contact.pull)
        others = [solid.mesh(frame - self.start)[0] for solid in solids.values()]
        others += [actor.skin(frame) for actor in self.animation.actors.values()]
        others += [one.points for one in self.bodies if one is not body]
        others += [path.places[0].position for path in self._paths(body)]
        return float((body.points @ down).min()) > max(float((points @ down).max()) for points in others)

    def _hold(self, frame: float, solids: dict[str, Obstacle]) -> None:
        """Turn bodies that hands hold by friction into fixed obstacles for the others."""
        if self.released:
            return
        skins = {name: self.animation.actors[name].skin(frame) for name in self.contact.flesh}
        for body in list(self.bodies) if skins else []:
            points = np.concatenate(list(skins.values()))
            near = points[np.linalg.norm(points - body.centre, axis=1) < body.shape.reach]
            if len(near) < 2:
                continue
            found = body.project(near)
            inside = found.distance < -_PRESSED
            names = [part.shape.name for part in body.parts]
            friction = min(self.contact.coefficient(name, actor) for name in names for actor in skins)
            if friction_closure(near[inside], -found.normal[inside], -found.distance[inside], friction):
                for part in body.parts:
                    self.paths[part.shape.name].held = frame
                    solids[part.shape.name] = _fixed(part)
                self.bodies.remove(body)


def _fixed(body: RigidBody) -> Obstacle:
    """A body as an obstacle that stands where it is."""
    facets = body.shape.facets
    return Keyframed(facets.faces, [0.0], body.stage(facets.vertices)[None])


def _meet(shapes: NDArray[np.float64], body: RigidBody, length: float, gain: float) -> bool:
    """Whether the box of a surface at two times (2, V, 3) comes near a body that moves for ``length`` seconds with an
    acceleration of at most ``gain`` [m/s²]."""
    reach = body.shape.reach + length * (body.speed + gain * length) + _CLOSE
    low, high = shapes.min(axis=(0, 1)) - reach, shapes.max(axis=(0, 1)) + reach
    return bool((body.centre > low).all() and (body.centre < high).all())
