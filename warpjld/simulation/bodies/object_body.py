"""An object that deforms: what leads it, what is prescribed of it, and what it stands on (R92, R128)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem import Prescribed
from warpjld.fem.load.loads import volumes
from warpjld.grasp import Places
from warpjld.simulation.animation import ObjectAnimation
from warpjld.simulation.bodies.applied_loads import AppliedLoads, applied_loads
from warpjld.simulation.bodies.deformable_body import DeformableBody, History, Surroundings
from warpjld.simulation.bodies.object_mesh import ObjectMesh, mesh_object
from warpjld.simulation.bodies.support import ObjectSupport, handle_of
from warpjld.simulation.specification import ContactSpecification, GripSpecification, located
from warpjld.simulation.state_variables import Points, PrescribedPoints

__all__ = ["ObjectBody", "build_object_body", "object_body"]

_FOOT = 0.05
"""Share of a lifted object's height, from below, whose points hold it until then."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ObjectBody(DeformableBody):
    """An object that deforms.

    Attributes:
        local: Its nodes in the object's own frame [m], shape (N, 3).
        place: Where the animation puts it at a time: one placement.
        states: What is prescribed, and the nodes it is prescribed for.
        start: Frame of time 0.
        support: What it stands on until a hand takes its weight.
        other: What is prescribed instead of all this, at a time.
        notes: What is to be told of its mesh.
        loads: Forces on it.
    """

    local: NDArray[np.float64]
    place: Callable[[float], Places]
    states: Sequence[tuple[PrescribedPoints, NDArray[np.int64]]]
    start: float
    support: ObjectSupport | None = None
    other: Callable[[float], Prescribed] | None = None
    notes: tuple[str, ...] = ()
    loads: AppliedLoads | None = None

    def deformed(
        self, displacement: NDArray[np.float64], covered: NDArray[np.floating] | None = None
    ) -> NDArray[np.float64]:
        """Its surface [m], shape (V, 3), under a displacement of its nodes (N, 3)."""
        return self.surface + self.embedding.carry(displacement)

    def holds(self, state: PrescribedPoints, time: float) -> bool:
        """Whether points go where the object goes."""
        stands = self.support is None or self.support.stands(time)
        return self.other is None and stands and state.holds(self.start + time)

    @property
    def _led(self) -> bool:
        return any(state.tracks for state, _ in self.states)

    def _held(self, time: float) -> bool:
        return any(self.holds(state, time) for state, _ in self.states)

    def _guided(self, time: float) -> bool:
        """Whether something else than its states leads it."""
        if self.other is not None:
            return True
        return self.support is not None and not self.support.stands(time) and time < self.support.free

    def prescribed(self, time: float, history: History) -> Prescribed:
        """Displacements of its prescribed points (R128)."""
        if self.other is not None:
            return self.other(time)
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        if self.support is not None:
            out = self.support.prescribed(time, history.bearing.get(self.name))
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
                begun = begun or frame >= track.keys[0].frame
                moved[:, "xyz".index(axis)] += float(track.spline(frame))
            if begun:
                degrees = (3 * nodes[:, None] + np.array(axes)).ravel()
                order = np.argsort(degrees)
                out = out + Prescribed(degrees[order], moved[:, axes].ravel()[order])
        return out

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings
    ) -> NDArray[np.float64]:
        """First guess of a displacement (N, 3): with what leads or carries it; what is free is where it was.

        Where hands close on it, it overlaps them there, and friction takes hold of it in that place. Put where it
        overlaps least, as a body without friction, it was taken out of grips that could have held it.
        """
        at = self.mesh.nodes + displacement
        if self._held(time):
            return displacement + (_rigid(self.place(before), self.place(time), at) - at)
        if self._guided(time):
            return displacement + _along_with(self.prescribed(time, around.history), displacement)
        if self._led:
            return displacement
        return displacement if around.carry is None else displacement + (around.carry(at) - at)

    def way(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Where nodes are, and are expected to be [m]."""
        x = self.mesh.nodes[nodes] + displacement[nodes]
        if not self._held(times[-1]):
            return [x for _ in times]  # what is free goes where it is pushed
        local = self.place(times[0]).to_local(x)[0]
        return [self.place(t).apply(local)[0] for t in times]

    def timed(self, clock: Callable[[float], float]) -> Self:
        """The same object, placed as it is at ``clock(time)``."""
        place = self.place
        return replace(self, place=lambda time: place(clock(time)))

    def driven(self, animation: ObjectAnimation) -> Self:
        """The same object, driven by another animation of it."""
        return replace(self, place=_place_at(animation, self.start))


def build_object_body(
    animation: ObjectAnimation, contact: ContactSpecification, start: float, place: Places | None = None
) -> ObjectBody:
    """An object that deforms, where it is at a frame or at another place.

    Raises:
        InputError: It cannot be meshed; names the line of its PHYSICAL.
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
                foot = Points("lower" if contact.pull[support.axis] < 0.0 else "upper", support.axis, _FOOT)
                states.append((PrescribedPoints(foot, held=True), foot.choose(volume.mesh.nodes, volume.mesh.nodes)))
        loads, mesh = applied_loads(contact, name, volume.mesh, volume.local)
        volume = replace(volume, mesh=mesh)
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
    """A meshed object with what leads it."""
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
    """Where an object is at a time [frames] from a frame."""
    return lru_cache(maxsize=8)(lambda time: animation.place(start + time))


def _states(
    contact: ContactSpecification, object_name: str, local: NDArray[np.float64], stage: NDArray[np.float64]
) -> list[tuple[PrescribedPoints, NDArray[np.int64]]]:
    """What is prescribed of an object, and for which nodes."""
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
    """The object with its weight, and what it stands on."""
    pull = np.array(contact.pull)
    axis = int(np.argmax(np.abs(pull)))
    if grip.weight is not None:
        density = grip.weight / (float(np.abs(pull).max()) * float(volumes(volume.mesh).sum()))
        volume = replace(volume, physical=replace(volume.physical, density=density))
    return volume, ObjectSupport(handle_of(volume.mesh.nodes), axis)


def _along_with(known: Prescribed, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far an object goes, axis by axis, whose known degrees of freedom go to these values [m], shape (3,)."""
    change = known.values - displacement.reshape(-1)[known.degrees]
    axes = known.degrees % 3
    return np.array([change[axes == axis].mean() if (axes == axis).any() else 0.0 for axis in range(3)])


def _rigid(before: Places, after: Places, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of a body that goes from one place to another."""
    turn = Rotation.from_quat(after.rotation[0])
    return np.asarray(turn.apply(before.to_local(points)[0]) + after.position[0])
