"""Contact problem after free objects have fallen: start frame, participating objects, their rigid motion (R139)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.grasp import GraspObject, Places
from warpjld.simulation.animation import ActorAnimation, AngleEdit, Animation, ObjectAnimation
from warpjld.simulation.bodies.absent_obstacle import AbsentObstacle
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.bodies.obstacle import placed_motion, rigid_obstacle
from warpjld.simulation.fall.bonded import bonded_groups
from warpjld.simulation.fall.fall_path import FallPath, fall_summaries
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.rigid_cluster import rigid_union
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.simulation.specification import ContactSpecification

if TYPE_CHECKING:
    from warpjld.simulation.solve.start_frame import StartFrame

__all__ = [
    "FallenAnimation",
    "FallenObject",
    "dropped_objects",
    "fallen_start",
    "falling_model",
    "moved_by",
    "released_bodies",
    "rest_frames",
    "standing_objects",
    "taking_part",
    "without",
]

_NEXT = 1.0
"""Frames after the last solved one at which an object with Dirichlet conditions counts as held."""


@dataclass(frozen=True, eq=False)
class FallenObject:
    """Animation of an object along its fall path (implements ``ObjectAnimation``)."""

    name: str
    thing: GraspObject
    path: FallPath

    def place(self, frame: float) -> Places:
        """Placement at a frame."""
        return self.path.at(frame)

    def obstacle(self, start: float) -> Obstacle:
        """The object as a rigid obstacle; times of the obstacle are in frames from ``start``."""
        return rigid_obstacle(self.thing, placed_motion(self.path.at, start))


class FallenAnimation:
    """Animation in which some objects follow their fall paths."""

    def __init__(self, animation: Animation, paths: Mapping[str, FallPath]) -> None:
        self._animation, self._paths = animation, paths
        fallen = {name: FallenObject(name, animation.objects[name].thing, path) for name, path in paths.items()}
        self._objects: dict[str, ObjectAnimation] = {**animation.objects, **fallen}

    @property
    def actors(self) -> Mapping[str, ActorAnimation]:
        """Actors of the original animation."""
        return self._animation.actors

    @property
    def objects(self) -> Mapping[str, ObjectAnimation]:
        """Objects in scene order."""
        return self._objects

    def edited(self, edits: Sequence[AngleEdit]) -> FallenAnimation:
        """A copy with edits applied to its actors; falling objects remain the same instances."""
        out = FallenAnimation(self._animation.edited(edits), self._paths)
        out._objects |= {name: self._objects[name] for name in self._paths}
        return out


def fallen_start(paths: Mapping[str, FallPath], first: float, last: float) -> float:
    """Frame from which contact is solved with fallen objects: when all rest, or just before the first is held."""
    held = [path.held for path in paths.values() if path.held is not None]
    if held:
        return max(first, np.ceil(min(held)) - 1.0)
    return max((path.rests for path in paths.values() if path.rests is not None), default=last)


def without(contact: ContactSpecification, names: Sequence[str]) -> ContactSpecification:
    """A copy of the specification in which some objects do not deform, and have neither bonds nor loads."""
    physical = {name: matter for name, matter in contact.physical.items() if name not in names}
    bonds = [bond for bond in contact.bonds if bond.one not in names and bond.other not in names]
    loads = {key: load for key, load in contact.loads.items() if key[0] not in names}
    spins = {name: spin for name, spin in contact.spins.items() if name not in names}
    return replace(contact, physical=physical, bonds=bonds, loads=loads, spins=spins)


def taking_part(paths: Mapping[str, FallPath], start: float) -> list[str]:
    """Names of objects that rest at a frame, or are held."""
    return [
        name
        for name, path in paths.items()
        if path.left is None and (path.held is not None or (path.rests is not None and path.rests <= start))
    ]


def released_bodies(
    model: ContactModel, frames: Sequence[SolvedFrame], contact: ContactSpecification, rate: float
) -> dict[str, RigidBody]:
    """Unconstrained objects after the last solved frame, as rigid bodies with their placement and velocity there.

    Args:
        model: The contact model.
        frames: Solved frames; velocities are differences of the last two.
        contact: Specification with weights and bonds.
        rate: Frames per second.
    """
    now, placed = frames[-1].frame if frames else model.start, {}
    for one in model.objects:
        if (
            _kept(one, now + _NEXT - model.start)
            or not contact.physical[one.name].density > 0.0
            or model.animation is None
        ):
            continue
        span = model.spans[one.name]
        shapes = [one.mesh.nodes + frame.displacement[span] for frame in frames[-2:]] or [one.mesh.nodes]
        shape = rigid_shape(one.name, model.animation.objects[one.name].thing, contact.physical[one.name])
        placed[one.name] = shape, [_fitted(one.local, points) for points in shapes]
    out: dict[str, RigidBody] = {}
    for group in bonded_groups(contact.physical, contact.bonds):
        if not placed.keys() >= set(group):
            continue
        body = rigid_union([(placed[name][0], placed[name][1][-1]) for name in group])
        if len(frames) > 1:
            length = (frames[-1].frame - frames[-2].frame) / rate
            before = rigid_union([(placed[name][0], placed[name][1][0]) for name in group])
            body.velocity = (body.centre - before.centre) / length
            body.spin = _turned(placed[group[0]][1]).as_rotvec() / length
        out |= dict.fromkeys(group, body)
    return out


def dropped_objects(model: ContactModel, frames: Sequence[SolvedFrame], contact: ContactSpecification) -> list[str]:
    """Objects whose points were held at the last solved frame, are free after it, and which touched nothing there.

    They fall whatever friction is. Bonded objects are dropped together or not at all.
    """
    if not frames:
        return []
    last, held, free = frames[-1], set(), set()
    time = last.frame - model.start
    for one in model.objects:
        held |= {one.name} if _kept(one, time) and one.falling(time) is None else set()
        free |= {one.name} if not _kept(one, time + _NEXT) and contact.physical[one.name].density > 0.0 else set()
    touched = {
        name
        for owner, forces in zip(model.owners, last.nodal, strict=True)
        for name in (owner.slave, owner.master)
        if name in free and owner.other(name) not in free and forces[model.spans[name]].any()
    }
    groups = bonded_groups([one.name for one in model.objects], contact.bonds)
    dropped = [group for group in groups if free.issuperset(group) and held & {*group} and not touched & {*group}]
    return [name for group in dropped for name in group]


def _kept(one: ObjectBody, time: float) -> bool:
    """Whether Dirichlet conditions, or the medium in which a hand lifts it, keep an object from falling."""
    return len(one.prescribed(time, History()).degrees) > 0 or one.rides(time)


def standing_objects(
    model: ContactModel, frames: Sequence[SolvedFrame], falling: Mapping[str, RigidBody]
) -> dict[str, Obstacle]:
    """Objects that do not fall, as they were solved last; those of which points follow the animation are left out."""
    now = (frames[-1].frame if frames else model.start) + _NEXT - model.start
    out: dict[str, Obstacle] = {}
    for one in model.objects if frames else ():
        if one.name not in falling and not any(one.holds(state, now) for state, _ in one.states):
            out[one.name] = RigidMesh(one.deformed(frames[-1].displacement[model.spans[one.name]]), one.triangles)
    return out


def falling_model(model: ContactModel, paths: Mapping[str, FallPath]) -> ContactModel:
    """The model in which objects that were let go follow their paths until they rest, and are free from then on.

    Until then they are rigid and push what deforms; obstacles, which their paths avoid already, do not push them.
    Objects that stay where they are, are left as they are.
    """
    assert model.animation is not None
    paths = {name: path for name, path in paths.items() if path.summary()}
    animation = FallenAnimation(model.animation, paths)
    times = {name: (path.frames[0] - model.start, _free_from(path) - model.start) for name, path in paths.items()}
    objects = [
        one.let_go(animation.objects[one.name], *times[one.name]) if one.name in paths else one for one in model.objects
    ]
    pairs = [
        replace(pair, master=AbsentObstacle(pair.master, *times[owner.slave]))
        if owner.slave in paths and isinstance(pair.master, Obstacle)
        else pair
        for pair, owner in zip(model.pairs, model.owners, strict=True)
    ]
    return replace(model, objects=tuple(objects), pairs=tuple(pairs), animation=animation)


def _free_from(path: FallPath) -> float:
    """Frame from which on a fallen object is in equilibrium; infinite if it is not."""
    return np.inf if path.rests is None or path.left is not None else path.rests


def rest_frames(model: ContactModel, paths: Mapping[str, FallPath], last: float) -> list[float]:
    """Frames up to ``last`` at which objects that were let go come to rest, ascending; empty if contact cannot go on
    after the falls.

    It cannot where everything stays where it was let go, so that nothing has changed; and there is no need where
    nothing else deforms, and nothing comes to rest.
    """
    paths = {name: path for name, path in paths.items() if path.summary()}
    if not paths:
        return []
    found = sorted({end for path in paths.values() if (end := _free_from(path)) <= last})
    others = model.hands or any(one.name not in paths for one in model.objects)
    return found or ([last] if others else [])


def _turned(places: Sequence[Places]) -> Rotation:
    """Rotation from the first of several placements to the last."""
    return Rotation.from_quat(places[-1].rotation[0]) * Rotation.from_quat(places[0].rotation[0]).inv()


def _fitted(local: NDArray[np.float64], shape: NDArray[np.float64]) -> Places:
    """Placement that fits points (n, 3) to others (n, 3) in the least-squares sense (Kabsch)."""
    here, there = local.mean(axis=0), shape.mean(axis=0)
    turn = Rotation.align_vectors(shape - there, local - here)[0]
    return Places((there - turn.apply(here))[None], turn.as_quat()[None])


def moved_by(paths: Mapping[str, FallPath], before: StartFrame, inside: Sequence[str]) -> StartFrame:
    """``before`` with the fall paths added: up to the start for objects that take part in contact, whole for others."""
    moved = dict(before.moved)
    for name, path in paths.items():
        end = before.start if name in inside else np.inf
        rows = [k for k, frame in enumerate(path.frames) if frame < end]
        frames, places = [path.frames[k] for k in rows], [path.places[k] for k in rows]
        if name in inside:
            frames, places = [*frames, before.start], [*places, path.at(before.start)]
        moved[name] = (frames, places)
    return replace(before, moved=moved, falls=tuple(fall_summaries(paths.values())))
