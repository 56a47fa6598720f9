"""Deformable object with its Dirichlet conditions, loads and support (R92, R128)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem import Prescribed
from warpjld.fem.load.loads import volumes
from warpjld.grasp import Places
from warpjld.simulation.animation import ObjectAnimation
from warpjld.simulation.bodies.applied_loads import AppliedLoads, applied_loads, idle_forces
from warpjld.simulation.bodies.deformable_body import DeformableBody, History, Surroundings
from warpjld.simulation.bodies.object_mesh import ObjectMesh, mesh_object
from warpjld.simulation.bodies.support import ObjectSupport
from warpjld.simulation.specification import ContactSpecification, GripSpecification, located
from warpjld.simulation.state_variables import Points, PrescribedPoints

__all__ = ["ObjectBody", "RigidFall", "build_object_body", "object_body"]

_FOOT, _WIDE = 0.05, 0.05
"""Lowest share of a lifted object's height, and least root mean square width of the points in it, over the object's
extent: these support the object until it is lifted. Where they do not, as below a lemon, the share is doubled."""


@dataclass(frozen=True, eq=False)
class RigidFall:
    """Rigid motion of an object that was let go, known from its integration as a rigid body.

    Attributes:
        place: Placement at a time (a batch of one).
        begins: Time at which it is let go.
        ends: Time from which on it is free again, at rest; infinite: it never rests.
    """

    place: Callable[[float], Places]
    begins: float
    ends: float

    def moves(self, time: float) -> bool:
        """Whether the object follows this fall at a time."""
        return self.begins + 1e-9 < time <= self.ends + 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class ObjectBody(DeformableBody):
    """A deformable object.

    Attributes:
        local: Its nodes in the object's own frame [m], shape (N, 3).
        place: Placement by the animation at a time (a batch of one).
        states: Prescribed state variables, with the nodes of each.
        start: Frame of time 0.
        support: Support it stands on until a hand takes its weight; None without.
        other: Dirichlet conditions at a time that replace those of states and support, for branches; None: none.
        notes: Messages about its mesh.
        loads: External loads on it.
        falls: Times at which it was let go and moves rigidly, ascending.
    """

    local: NDArray[np.float64]
    place: Callable[[float], Places]
    states: Sequence[tuple[PrescribedPoints, NDArray[np.int64]]]
    start: float
    support: ObjectSupport | None = None
    other: Callable[[float], Prescribed] | None = None
    notes: tuple[str, ...] = ()
    loads: AppliedLoads | None = None
    falls: tuple[RigidFall, ...] = ()

    def deformed(
        self, displacement: NDArray[np.float64], covered: NDArray[np.floating] | None = None
    ) -> NDArray[np.float64]:
        """Visible surface [m], shape (V, 3), under a displacement of its nodes (N, 3)."""
        return self.surface + self.embedding.carry(displacement)

    def holds(self, state: PrescribedPoints, time: float) -> bool:
        """Whether the points of a state variable follow the object's placement at a time."""
        stands = self.support is None or self.support.stands(time)
        return self.other is None and stands and state.holds(self.start + time)

    def falling(self, time: float) -> RigidFall | None:
        """The fall that moves it at a time; None if it does not fall then."""
        return next((fall for fall in self.falls if fall.moves(time)), None)

    def carried_by(self, fall: RigidFall, time: float) -> NDArray[np.float64]:
        """Displacement of its nodes at a time of a fall, in which it is rigid [m], shape (N, 3)."""
        return np.asarray(fall.place(time).apply(self.local)[0] - self.mesh.nodes)

    @property
    def _led(self) -> bool:
        return any(state.tracks for state, _ in self.states)

    def _held(self, time: float) -> bool:
        return any(self.holds(state, time) for state, _ in self.states)

    def _guided(self, time: float) -> bool:
        """Whether conditions of a branch drive it instead of its state variables, or it rides along with a hand."""
        return self.other is not None or self.rides(time)

    def rides(self, time: float) -> bool:
        """Whether it rides along with a hand that lifts it, in a medium that bears a share of its weight."""
        return self.support is not None and not self.support.stands(time) and time < self.support.free

    def prescribed(self, time: float, history: History) -> Prescribed:
        """Dirichlet conditions of its prescribed points (R128)."""
        if self.other is not None:
            return self.other(time)
        if (fall := self.falling(time)) is not None:
            return Prescribed(np.arange(3 * len(self.local)), self.carried_by(fall, time).ravel())
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        frame = self.start + time
        for state, nodes in self.states:
            moved = np.zeros((len(nodes), 3))
            axes = [k for k, axis in enumerate("xyz") if axis in state.tracks]
            held = self.holds(state, time)
            if held:
                axes = [0, 1, 2]
                moved = self.place(time).apply(self.local[nodes])[0] - self.mesh.nodes[nodes]
            begun = held
            for axis, track in state.tracks.items():
                begun = begun or frame >= track.frames[0]
                moved[:, "xyz".index(axis)] += float(track.spline(frame))
            if begun:
                degrees = (3 * nodes[:, None] + np.array(axes)).ravel()
                order = np.argsort(degrees)
                out = out + Prescribed(degrees[order], moved[:, axes].ravel()[order])
        return out

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings
    ) -> NDArray[np.float64]:
        """Predictor: displacement (N, 3) with the rigid motion of what drives or carries the object; zero when free.

        A free object on which hands close stays in place and overlaps them, so that friction holds it there. Moving it
        to the least overlap, as if frictionless, took it out of grips that could have held it.
        """
        at = self.mesh.nodes + displacement
        if self._held(time):
            return displacement + (_rigid(self.place(before), self.place(time), at) - at)
        if self._guided(time):
            return displacement + _mean_shift(self.prescribed(time, around.history), displacement)
        if self._led:
            return displacement
        return displacement if around.carry is None else displacement + (around.carry(at) - at)

    def path(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Current and predicted positions of nodes [m]."""
        x = self.mesh.nodes[nodes] + displacement[nodes]
        if (fall := self.falling(times[-1])) is not None:
            return [x, *(fall.place(t).apply(self.local[nodes])[0] for t in times[1:])]
        if not self._held(times[-1]):
            return [x for _ in times]  # the motion of a free object is not known in advance
        local = self.place(times[0]).to_local(x)[0]
        return [self.place(t).apply(local)[0] for t in times]

    def timed(self, clock: Callable[[float], float]) -> Self:
        """A copy placed at ``time`` as this object is at ``clock(time)``."""
        place = self.place
        return replace(self, place=lambda time: place(clock(time)))

    def let_go(self, animation: ObjectAnimation, begins: float, ends: float) -> Self:
        """A copy that nothing holds any more: it follows an animation rigidly from one time to another, and is free
        after that."""
        place = _place_at(animation, self.start)
        falls = (*self.falls, RigidFall(place, begins, ends))
        return replace(self, place=place, states=(), support=None, falls=falls)

    def driven(self, animation: ObjectAnimation) -> Self:
        """A copy driven by another animation of the object."""
        return replace(self, place=_place_at(animation, self.start))


def build_object_body(
    animation: ObjectAnimation, contact: ContactSpecification, start: float, place: Places | None = None
) -> ObjectBody:
    """Mesh a deformable object at its placement at a frame, or at ``place``, and apply its conditions.

    Raises:
        InputError: It cannot be meshed, or its points select nothing; names the line of its PHYSICAL command.
    """
    name, thing = animation.name, animation.thing
    physical = contact.physical[name]
    at = _place_at(animation, start)
    try:
        volume = mesh_object(name, thing, physical, at(0.0) if place is None else place)
        states = _states(contact, name, volume.local, thing.place.apply(volume.local)[0])
        support = None
        if (grip := contact.lifted(name)) is not None:
            volume, support = _lifted(contact, grip, volume)
            if not states:
                foot = _foot(volume.mesh.nodes, support.axis, "lower" if contact.pull[support.axis] < 0.0 else "upper")
                states.append((PrescribedPoints(foot, held=True), foot.choose(volume.mesh.nodes, volume.mesh.nodes)))
        loads, mesh = applied_loads(contact, name, volume.mesh, volume.local)
        held = [nodes for one, nodes in states if one.held and np.isinf(one.until)]
        idle = idle_forces(contact, loads, np.concatenate([np.empty(0, dtype=np.int64), *held]))
        volume = replace(volume, mesh=mesh, notes=(*volume.notes, *idle))
    except InputError as error:
        raise located(InputError(f"{name}: {error.message}"), physical.where) from error
    return replace(object_body(volume, at, states, start, support), loads=loads)


def object_body(
    volume: ObjectMesh,
    place: Callable[[float], Places],
    states: Sequence[tuple[PrescribedPoints, NDArray[np.int64]]],
    start: float,
    support: ObjectSupport | None = None,
) -> ObjectBody:
    """Assemble a deformable object from its mesh, placement over time, state variables and support."""
    physical = volume.physical
    return ObjectBody(
        name=volume.name,
        mesh=volume.mesh,
        faces=volume.name,
        laws=physical.laws(volume.name, volume.regions),
        modulus=physical.young,
        stress=volume.stress,
        surface=volume.surface,
        triangles=volume.faces,
        embedding=volume.visible,
        embedded=np.ones(len(volume.surface), dtype=bool),
        pressure_inside=(volume.inside, physical.pressure) if physical.pressure else None,
        local=volume.local,
        place=place,
        states=states,
        start=start,
        support=support,
        notes=volume.notes,
    )


def _place_at(animation: ObjectAnimation, start: float) -> Callable[[float], Places]:
    """Placement of an object as a function of time [frames from ``start``], cached."""
    return lru_cache(maxsize=8)(lambda time: animation.place(start + time))


def _states(
    contact: ContactSpecification, object_name: str, local: NDArray[np.float64], stage: NDArray[np.float64]
) -> list[tuple[PrescribedPoints, NDArray[np.int64]]]:
    """State variables of an object, with the nodes of each.

    Raises:
        InputError: A point set selects no node.
    """
    states = []
    for (name, points), state in contact.prescribed.items():
        if name == object_name:
            try:
                states.append((state, state.points.choose(local, stage)))
            except InputError as error:
                raise InputError(f"points {points}: {error.message}") from None
    return states


def _lifted(
    contact: ContactSpecification, grip: GripSpecification, volume: ObjectMesh
) -> tuple[ObjectMesh, ObjectSupport]:
    """Object mesh with the density that gives the requested weight, and its support."""
    pull = np.array(contact.pull)
    axis = int(np.argmax(np.abs(pull)))
    if grip.weight is not None:
        density = grip.weight / (float(np.abs(pull).max()) * float(volumes(volume.mesh).sum()))
        volume = replace(volume, physical=replace(volume.physical, density=density))
    return volume, ObjectSupport(axis)


def _foot(nodes: NDArray[np.float64], axis: int, side: Literal["lower", "upper"]) -> Points:
    """The lowest points of an object, enough of them not to lie on a line, on which it could turn."""
    share, extent = _FOOT, float(np.linalg.norm(np.ptp(nodes, axis=0)))
    while share < 1.0:
        foot = Points(side, axis, share)
        x = nodes[foot.choose(nodes, nodes)]
        spread = np.linalg.svd(x - x.mean(axis=0), compute_uv=False) / np.sqrt(len(x))
        if len(x) > 2 and spread[1] > _WIDE * extent:
            return foot
        share *= 2.0
    return Points(side, axis, 1.0)


def _mean_shift(known: Prescribed, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean change of the prescribed displacements by axis [m], shape (3,); 0 on axes without any."""
    change = known.values - displacement.reshape(-1)[known.degrees]
    axes = known.degrees % 3
    return np.array([change[axes == axis].mean() if (axes == axis).any() else 0.0 for axis in range(3)])


def _rigid(before: Places, after: Places, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3) [m] moved rigidly from one placement to another."""
    turn = Rotation.from_quat(after.rotation[0])
    return np.asarray(turn.apply(before.to_local(points)[0]) + after.position[0])
