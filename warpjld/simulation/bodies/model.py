"""Contact model: all bodies merged into one mesh, with pairs, loads and Dirichlet conditions (R103, R109, R110)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import Body, Loads, Material, Prescribed, merge
from warpjld.fem.contact import Bond, Obstacle, Pair
from warpjld.fem.contact.results.nodal_contact import tributary_areas
from warpjld.fem.load.loads import external_forces
from warpjld.simulation.animation import AngleEdit, Animation
from warpjld.simulation.bodies.deformable_body import DeformableBody, History, Surroundings
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.bodies.surface_offset import face_offsets, node_offsets
from warpjld.simulation.specification import ContactSpecification, located

__all__ = ["ContactModel", "PairOwners", "assemble_model"]


@dataclass(frozen=True)
class PairOwners:
    """Names of the actors or objects whose surfaces form a contact pair; an obstacle is always the master."""

    slave: str
    master: str

    def other(self, name: str) -> str | None:
        """Contact partner of one of the two (itself for self-contact); None if ``name`` is neither."""
        if name == self.slave:
            return self.master
        return self.slave if name == self.master else None


@dataclass(frozen=True, eq=False)
class ContactModel:
    """All bodies of a simulation merged into one, hands first.

    Attributes:
        hands: Hands, in the order of their nodes.
        objects: Deformable objects, in order, after the hands.
        obstacles: Rigid obstacles by name.
        body: Merged mesh and laws.
        spans: Rows of the merged nodes of each hand and object, by name.
        pairs: Contact pairs.
        owners: Names of the bodies of each pair.
        loads: Gravity and inner pressures, constant in time.
        start: Frame of time 0.
        animation: Animation that drives the model; None where none is edited.
    """

    hands: tuple[FleshBody, ...]
    objects: tuple[ObjectBody, ...]
    obstacles: Mapping[str, Obstacle]
    body: Body
    spans: dict[str, slice]
    pairs: tuple[Pair, ...]
    owners: tuple[PairOwners, ...]
    loads: Loads
    start: float = 0.0
    animation: Animation | None = None

    @property
    def bodies(self) -> tuple[DeformableBody, ...]:
        """Hands and objects."""
        return (*self.hands, *self.objects)

    def named(self, name: str) -> DeformableBody:
        """Body by name."""
        return next(body for body in self.bodies if body.name == name)

    def tributary_areas(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Surface area around every node at positions x (N, 3) [m²], 0 for inner nodes, shape (N,)."""
        return sum((tributary_areas(self.body.mesh, body.faces, x) for body in self.bodies), np.zeros(len(x)))

    def prescribed(self, time: float, history: History) -> Prescribed:
        """Dirichlet conditions of all bodies at a time."""
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        for body in self.bodies:
            known = body.prescribed(time, history)
            out = out + Prescribed(known.degrees + 3 * self.spans[body.name].start, known.values)
        return out

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], history: History
    ) -> NDArray[np.float64]:
        """Predictor: displacement (N, 3) [m] at ``time`` from that at ``before``, with Dirichlet values inserted."""
        out = displacement.copy()
        for body in self.bodies:
            span = self.spans[body.name]
            carry = self._carry(history.carried.get(body.name), before, time)
            out[span] = body.guess(before, time, displacement[span], Surroundings(carry, history))
        known = self.prescribed(time, history)
        out.reshape(-1)[known.degrees] = known.values
        return out

    def loads_at(self, time: float, history: History) -> Loads:
        """External loads at a time, including what bears and resists objects that ride along with a hand."""
        out = np.zeros((0, 3))
        loads, frame = self.loads, self.start + time
        for one in self.objects:
            if one.support is not None and one.support.resistance(time):
                out = out if len(out) else np.zeros_like(self.body.mesh.nodes)
                pull = self.pull(one.name)
                out -= one.support.borne(time) * pull
                each = np.linalg.norm(pull, axis=1)
                drag = one.support.resistance(time) * each / each.sum()
                loads = replace(loads, drag=drag if loads.drag is None else loads.drag + drag)
        for one in self.objects:
            if one.loads:
                out = out if len(out) else np.zeros_like(self.body.mesh.nodes)
                out[self.spans[one.name]] += one.loads.forces(frame, len(one.mesh.nodes))
                loads = one.loads.added_to(loads, frame)
        return replace(loads, nodal=out) if len(out) else loads

    def pull(self, name: str) -> NDArray[np.float64]:
        """Weight of an object on all nodes [N], shape (N, 3)."""
        whole = external_forces(self.body, Loads(gravity=self.loads.gravity)).reshape(-1, 3)
        out = np.zeros_like(whole)
        out[self.spans[name]] = whole[self.spans[name]]
        return out

    def after(self, nodal: NDArray[np.float64]) -> History:
        """History after an equilibrium with contact forces of each pair [N], shape (P, N, 3): which hand holds each
        free object."""
        hands = {hand.name for hand in self.hands}
        carried: dict[str, str] = {}
        for one in self.objects:
            span = self.spans[one.name]
            pushes: dict[str, float] = {}
            for owner, forces in zip(self.owners, nodal[:, span], strict=True):
                other = owner.other(one.name)
                if other is not None and forces.any():
                    pushes[other] = pushes.get(other, 0.0) + float(np.linalg.norm(forces, axis=1).sum())
            if pushes and set(pushes) <= hands:
                carried[one.name] = max(pushes, key=lambda name: pushes[name])
        return History(carried)

    def edited(self, edits: Sequence[AngleEdit]) -> ContactModel:
        """A copy driven by its animation with edits applied; hands, objects and obstacles that change are replaced."""
        if not edits:
            return self
        assert self.animation is not None
        animation, old = self.animation.edited(edits), self.animation
        actors = {name: one for name, one in animation.actors.items() if one is not old.actors[name]}
        others = {name: one for name, one in animation.objects.items() if one is not old.objects[name]}
        hands = [hand.driven(actors[hand.name]) if hand.name in actors else hand for hand in self.hands]
        objects = [one.driven(others[one.name]) if one.name in others else one for one in self.objects]
        again = {name: others[name].obstacle(self.start) for name in self.obstacles if name in others}
        pairs = [
            replace(pair, master=again[owner.master]) if owner.master in again else pair
            for pair, owner in zip(self.pairs, self.owners, strict=True)
        ]
        return replace(
            self,
            hands=tuple(hands),
            objects=tuple(objects),
            obstacles={**self.obstacles, **again},
            pairs=tuple(pairs),
            animation=animation,
        )

    def _carry(
        self, name: str | None, before: float, time: float
    ) -> Callable[[NDArray[np.float64]], NDArray[np.float64]] | None:
        """Rigid motion of points with a hand between two times; None without a hand."""
        if name is None:
            return None
        hand = next(hand for hand in self.hands if hand.name == name)
        return lambda points: hand.carry(before, time, points)


def assemble_model(
    hands: Sequence[FleshBody],
    objects: Sequence[ObjectBody],
    obstacles: Mapping[str, Obstacle],
    contact: ContactSpecification,
    *,
    start: float = 0.0,
    animation: Animation | None = None,
) -> ContactModel:
    """Merge bodies and form contact pairs; the softer surface of a pair is the slave, which carries the multipliers.

    ``start`` is the frame of time 0; ``animation`` drives all bodies and is needed for edits.

    Raises:
        InputError: No deformable body, a name used twice, or a bond to an object that does not deform.
    """
    bodies: list[DeformableBody] = [*hands, *objects]
    if not bodies:
        raise InputError("nothing deforms: make a body do so with FLESH or PHYSICAL")
    sets = [name for body in bodies for name in body.mesh.faces if name != body.faces]  # insides, as ``BALL.inside``
    names = [name.lower() for name in (*(body.name for body in bodies), *obstacles, *sets)]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(f"two bodies are called {twice}: want a name of its own for each")
    for bonded in contact.bonds:
        for name in (bonded.one, bonded.other):
            if name not in {one.name for one in objects}:
                text = f"a bond to nothing: {name} does not deform here: PHYSICAL {name} makes it so"
                raise located(InputError(text), bonded.where)
    ends = np.cumsum([0, *(len(body.mesh.nodes) for body in bodies)])
    spans = {body.name: slice(int(a), int(b)) for body, a, b in zip(bodies, ends[:-1], ends[1:], strict=True)}
    laws: dict[str, Material] = {}
    for one in bodies:
        laws |= one.laws
    mesh = merge(*(one.mesh for one in bodies))
    stress = np.concatenate([one.stress for one in bodies])
    body = Body(mesh, {name: laws[name] for name in mesh.region_names}, initial_stress=stress)
    pressure = dict(one.pressure_inside for one in bodies if one.pressure_inside is not None)
    paper = contact.pressing is not None and contact.pressing.method == "paper"  # knows nodes only
    pairs, owners = _pairs(bodies, obstacles, contact, paper)
    if not paper:
        mean, own = (np.concatenate([_offsets(one, how) for one in bodies]) for how in (face_offsets, node_offsets))
        pairs = [replace(pair, offset=own if isinstance(pair.master, Obstacle) else mean) for pair in pairs]
    loads = Loads(gravity=contact.pull, pressure=pressure)
    found = (tuple(pairs), tuple(owners))
    return ContactModel(tuple(hands), tuple(objects), obstacles, body, spans, *found, loads, start, animation)


def _offsets(body: DeformableBody, how: Callable[..., NDArray[np.float64]]) -> NDArray[np.float64]:
    """Height of a body's visible surface above its mesh surface [m], shape (N,)."""
    carried = body.triangles[body.embedded[body.triangles].all(axis=1)]
    return how(body.mesh, body.faces, body.surface, carried)


def _pairs(
    bodies: Sequence[DeformableBody], obstacles: Mapping[str, Obstacle], contact: ContactSpecification, paper: bool
) -> tuple[list[Pair], list[PairOwners]]:
    """All contact pairs. In the paper's loop objects are slaves of the skin, and there is no self-contact."""
    pairs, owners = [], []
    for k, one in enumerate(bodies):
        for other in bodies[k + 1 :]:
            bonded = contact.bond(one.name, other.name)
            bond = None if bonded is None else Bond(bonded.normal, bonded.shear, bonded.parted)
            slave, master = (one, other) if one.modulus <= other.modulus and not paper else (other, one)
            friction, title = contact.coefficient(one.name, other.name), f"{slave.name}–{master.name}"
            pairs.append(Pair(slave.faces, master.faces, friction, title, bond=bond))
            owners.append(PairOwners(slave.name, master.name))
        for name, obstacle in obstacles.items():
            pairs.append(Pair(one.faces, obstacle, contact.coefficient(one.name, name), f"{one.name}–{name}"))
            owners.append(PairOwners(one.name, name))
    for one in bodies:
        exclusion = None if paper else one.self_contact
        if exclusion is not None:
            friction = contact.coefficient(one.name, one.name)
            pairs.append(Pair(one.faces, one.faces, friction, f"{one.name}–{one.name}", exclusion))
            owners.append(PairOwners(one.name, one.name))
    return pairs, owners
