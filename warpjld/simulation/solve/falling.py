"""Rigid-body fall of unsupported objects until they rest or hands hold them by friction (R139).

Contact of deformable bodies is solved quasi-statically, and a falling object has no equilibrium. So an object with
weight that no hand holds and no Dirichlet condition constrains is integrated as a rigid body (``simulation.fall``)
frame by frame; bonded objects are one. The quasi-static solve starts when they rest or are held. Where a strike may
open a bond, the impact is solved with finite elements, and the pieces go on as rigid bodies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from warpjld.fem.contact import Obstacle
from warpjld.simulation.animation import Animation
from warpjld.simulation.fall.bonded import bonded_groups
from warpjld.simulation.fall.fall_path import FallPath
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.rigid_cluster import rigid_union
from warpjld.simulation.fall.rigid_load import rigid_load
from warpjld.simulation.solve.falling_stage import FallingStage
from warpjld.simulation.specification import BondStrength, ContactSpecification, SolveSpecification

__all__ = ["Falls", "falling_names", "follow_falls"]


@dataclass(frozen=True, eq=False)
class Falls:
    """Falls of free objects.

    Attributes:
        paths: Their paths by name.
        bonds: Bonds of the scene that hold after them.
        openings: Messages about bonds that impacts opened, and about impacts that were not solved.
        interrupted: Frame after which Ctrl-C ended them; None if nothing did.
    """

    paths: dict[str, FallPath]
    bonds: list[BondStrength]
    openings: tuple[str, ...] = ()
    interrupted: float | None = None

    @property
    def listed(self) -> str:
        """``'BAR_1' and 'BAR_2'``: the names of what moves."""
        return " and ".join(f"'{name}'" for name, path in self.paths.items() if path.summary())


def falling_names(contact: ContactSpecification, request: SolveSpecification) -> list[str]:
    """Deformable objects with weight that neither Dirichlet conditions, a grip that lifts them, nor an object bonded
    to them keep from falling."""
    if request.method == "paper" or not any(contact.pull):
        return []
    stands = {name for name, _ in contact.prescribed} | {grip.object for grip in contact.grips if grip.lift}
    stands |= {name for name, matter in contact.physical.items() if not matter.density > 0.0}
    stands |= {name for bond in contact.bonds for name in (bond.one, bond.other)} - set(contact.physical)
    groups = bonded_groups([*contact.physical, *(stands - set(contact.physical))], contact.bonds)
    free = {name for group in groups if stands.isdisjoint(group) for name in group}
    return [name for name in contact.physical if name in free]


def follow_falls(
    animation: Animation,
    contact: ContactSpecification,
    request: SolveSpecification,
    names: Sequence[str],
    *,
    released: Mapping[str, RigidBody] | None = None,
    standing: Mapping[str, Obstacle] | None = None,
    first: float | None = None,
) -> Falls:
    """Falls of free objects, each until the last frame or until hands hold it.

    Args:
        animation: Motion of everything else.
        contact: Specification with friction, weights, bonds and actors with flesh.
        request: Frames and frame rate.
        names: Names of the free objects.
        released: Rigid bodies at the ``first`` frame, for objects that hands have released; hands then no longer hold
            them.
        standing: Other objects that stand elsewhere than in the animation, or deformed.
        first: First frame; by default the request's.
    """
    start = float(request.first) if first is None else first
    bonds = list(contact.bonds)
    loads = {name: rigid_load(contact, name, animation.objects[name].thing) for name in names}
    stage = FallingStage(
        animation,
        replace(contact, bonds=bonds),
        request,
        start,
        bool(released),
        standing or {},
        {name: load for name, load in loads.items() if load is not None},
    )
    for body in _released(released) if released else []:
        stage.add(body)
    for group in [] if released else bonded_groups(names, contact.bonds):
        objects = [animation.objects[name] for name in group]
        members = [(rigid_shape(one.name, one.thing, contact.physical[one.name]), one.place(start)) for one in objects]
        stage.add(rigid_union(members))
    paths = stage.followed()
    return Falls({name: paths[name] for name in names}, stage.contact.bonds, tuple(stage.openings), stage.interrupted)


def _released(bodies: Mapping[str, RigidBody]) -> list[RigidBody]:
    """Bodies by the names of their objects, each once."""
    return list({id(body): body for body in bodies.values()}.values())
