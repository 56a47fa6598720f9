"""Everything that may touch, as one body with pairs of surfaces, and what drives it (R103, R109, R110)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem import Body, Loads, Material, Prescribed, merge
from warpjld.fem.contact import Bond, Obstacle, Pair
from warpjld.grasp import Places
from warpjld.simulation.bodies.flesh_body import HandBody
from warpjld.simulation.bodies.object_body import ObjectBody
from warpjld.simulation.bodies.surface_offset import outside, outside_of_nodes
from warpjld.simulation.solve.free_object import settle
from warpjld.simulation.specification import placed
from warpjld.simulation.specification import ContactWishes

__all__ = ["Bodies", "PairOf", "assemble"]

_ON = 2e-4
"""An object nearer to an obstacle than this lies on it [m]."""


@dataclass(frozen=True)
class PairOf:
    """What a pair of surfaces belongs to: actors' and objects' names, an obstacle's last."""

    slave: str
    master: str


@dataclass(eq=False)
class Bodies:
    """All bodies of a scene merged into one, hands first.

    Attributes:
        hands: In order.
        objects: In order, after them.
        obstacles: By name.
        body: Mesh and laws.
        spans: Rows of the merged nodes that belong to each hand and object, by name.
        pairs: What may touch what.
        owners: Whose surfaces those are.
        loads: From time 0 on.
        start: Frame of time 0.
        carried: Objects that only hands hold, by the hand: they go along with it in first guesses.
        touched: Objects that something touches.
    """

    hands: tuple[HandBody, ...]
    objects: tuple[ObjectBody, ...]
    obstacles: Mapping[str, Obstacle]
    body: Body
    spans: dict[str, slice]
    pairs: tuple[Pair, ...]
    owners: tuple[PairOf, ...]
    loads: Loads
    start: float = 0.0
    carried: dict[str, str] = field(default_factory=dict)
    touched: set[str] = field(default_factory=set)

    @property
    def surfaces(self) -> dict[str, str]:
        """The merged mesh's face set of each hand and object, by name."""
        return {one.name: one.part.hand.name for one in self.hands} | {
            one.name: one.volume.name for one in self.objects
        }

    def prescribed(self, time: float) -> Prescribed:
        """All known displacements at a time."""
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        movers: list[HandBody | ObjectBody] = [*self.hands, *self.objects]
        for one in movers:
            known = one.prescribed(time)
            out = out + Prescribed(known.degrees + 3 * self.spans[one.name].start, known.values)
        return out

    def guess(self, before: float, time: float, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """First guess of the displacement (N, 3) at a time from that at an earlier one."""
        out = displacement.copy()
        for hand in self.hands:
            span = self.spans[hand.name]
            out[span] = hand.guess(before, time, displacement[span])
        for one in self.objects:
            span = self.spans[one.name]
            at = one.volume.mesh.nodes + displacement[span]
            if any(one.holds(state, time) for state, _ in one.states):
                out[span] += _rigid(one.place(before), one.place(time), at) - at
            elif one.guided(time):
                out[span] += _along_with(one.prescribed(time), displacement[span])
            elif not any(state.tracks for state, _ in one.states):
                if one.name in self.carried:
                    out[span] += self._along(self.carried[one.name], before, time, at) - at
                elif one.name not in self.touched:
                    out[span] = self._settled(one, at, time, out) - one.volume.mesh.nodes
        known = self.prescribed(time)
        out.reshape(-1)[known.degrees] = known.values
        return out

    def loads_at(self, time: float) -> Loads:
        """What pulls and pushes at a time beside contact."""
        out = np.zeros((0, 3))
        for one in self.objects:
            fading = None if one.support is None else one.support.fading(time)
            if fading is not None:
                out = out if len(out) else np.zeros_like(self.body.mesh.nodes)
                out[self.spans[one.name]] += fading
        return replace(self.loads, nodal=out) if len(out) else self.loads

    def note(
        self, time: float, displacement: NDArray[np.float64], reactions: NDArray[np.float64], nodal: NDArray[np.float64]
    ) -> None:
        """Take note of what holds the free objects.

        Args:
            time: Of an equilibrium.
            displacement: Of all nodes [m], shape (N, 3).
            reactions: Of what is prescribed [N], shape (N, 3).
            nodal: Contact forces of each pair [N], shape (P, N, 3).
        """
        self.carried.clear()
        self.touched.clear()
        hands = {hand.name for hand in self.hands}
        for one in self.objects:
            if one.support is not None:
                one.support.note(time, displacement[self.spans[one.name]], reactions[self.spans[one.name]])
            pushes: dict[str, float] = {}
            for owner, forces in zip(self.owners, nodal[:, self.spans[one.name]], strict=True):
                if one.name in (owner.slave, owner.master) and forces.any():
                    other = owner.master if owner.slave == one.name else owner.slave
                    pushes[other] = pushes.get(other, 0.0) + float(np.linalg.norm(forces, axis=1).sum())
            if pushes:
                self.touched.add(one.name)
            if pushes and set(pushes) <= hands:
                self.carried[one.name] = max(pushes, key=lambda name: pushes[name])

    def _settled(
        self, one: ObjectBody, at: NDArray[np.float64], time: float, displacement: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Where an object that nothing holds goes among hands; friction holds it on obstacles."""
        if any(float(obstacle.project(at, time).distance.min()) < _ON for obstacle in self.obstacles.values()):
            return at
        mesh = one.volume.mesh
        quads = mesh.quads(mesh.face_set(one.name))
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        skins = [np.empty((0, 3))]
        for hand in self.hands:
            flesh = hand.part.hand
            skin = np.unique(flesh.mesh.quads(flesh.skin_faces))
            skins.append(flesh.mesh.nodes[skin] + displacement[self.spans[hand.name]][skin])
        found = settle(at, triangles, np.concatenate(skins), list(self.obstacles.values()), time)
        return found.of(at)

    def _along(self, name: str, before: float, time: float, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points carried along by a hand as a whole."""
        hand = next(h for h in self.hands if h.name == name)
        step = hand.moves(before).to(hand.moves(time))
        root = np.zeros(len(points), np.int64)
        return step.of(root, points)


def assemble(
    hands: Sequence[HandBody],
    objects: Sequence[ObjectBody],
    obstacles: Mapping[str, Obstacle],
    wishes: ContactWishes,
    *,
    start: float = 0.0,
) -> Bodies:
    """Merge bodies and pair their surfaces: the softer side of two is the one where pressures live.

    ``start`` is the frame of time 0.

    Raises:
        InputError: Nothing that deforms, or a bond to what is not there.
    """
    if not hands and not objects:
        raise InputError("nothing deforms: make a body do so with FLESH or PHYSICAL")
    meshes = [*(h.part.hand.mesh for h in hands), *(o.volume.mesh for o in objects)]
    ends = np.cumsum([0, *(len(mesh.nodes) for mesh in meshes)])
    names = [*(h.name for h in hands), *(o.name for o in objects)]
    spans = {name: slice(int(a), int(b)) for name, a, b in zip(names, ends[:-1], ends[1:], strict=True)}
    laws: dict[str, Material] = {}
    for hand in hands:
        laws |= hand.laws
    laws |= {o.name: o.volume.physical.material() for o in objects}
    stress = np.concatenate(
        [*(np.zeros((len(h.part.hand.mesh.elements), 6)) for h in hands), *(o.volume.stress for o in objects)]
    )
    mesh = merge(*meshes)
    body = Body(mesh, {name: laws[name] for name in mesh.region_names}, initial_stress=stress)
    pressure = {o.volume.inside: o.volume.physical.pressure for o in objects if o.volume.physical.pressure}
    paper = wishes.pressing is not None and wishes.pressing.method == "paper"  # knows nodes only
    pairs, owners = _pairs(hands, objects, obstacles, wishes)
    if not paper:
        everything: list[HandBody | ObjectBody] = [*hands, *objects]
        mean, own = (np.concatenate([_outside(one, how) for one in everything]) for how in (outside, outside_of_nodes))
        pairs = [replace(pair, offset=own if isinstance(pair.master, Obstacle) else mean) for pair in pairs]
    loads = Loads(gravity=wishes.pull, pressure=pressure)
    return Bodies(tuple(hands), tuple(objects), obstacles, body, spans, tuple(pairs), tuple(owners), loads, start)


def _outside(one: HandBody | ObjectBody, how: Callable[..., NDArray[np.float64]]) -> NDArray[np.float64]:
    """How far what is seen lies outside a body's faces or nodes [m], shape (N,)."""
    if isinstance(one, ObjectBody):
        volume = one.volume
        return how(volume.mesh, volume.name, volume.surface, volume.faces)
    flesh = one.part.hand
    return how(flesh.mesh, flesh.name, one.part.skin, one.part.faces)


def _pairs(
    hands: Sequence[HandBody],
    objects: Sequence[ObjectBody],
    obstacles: Mapping[str, Obstacle],
    wishes: ContactWishes,
) -> tuple[list[Pair], list[PairOf]]:
    soft = [(h.name, h.part.hand.name, h.softness) for h in hands]
    soft += [(o.name, o.volume.name, o.volume.physical.young) for o in objects]
    # the paper's loop repels objects from the skin, and does not know skin that meets itself
    paper = wishes.pressing is not None and wishes.pressing.method == "paper"
    pairs, owners = [], []
    for k, (name, faces, modulus) in enumerate(soft):
        for other, other_faces, other_modulus in soft[k + 1 :]:
            bonded = wishes.bond(name, other)
            bond = None if bonded is None else Bond(normal=bonded.normal, shear=bonded.shear)
            sides = [(name, faces), (other, other_faces)]
            (slave, one), (master, two) = sides if modulus <= other_modulus and not paper else sides[::-1]
            friction = wishes.coefficient(name, other)
            pairs.append(Pair(one, two, friction, f"{slave}–{master}", bond=bond))
            owners.append(PairOf(slave, master))
        for other, obstacle in obstacles.items():
            pairs.append(Pair(faces, obstacle, wishes.coefficient(name, other), f"{name}–{other}"))
            owners.append(PairOf(name, other))
    for hand in hands:
        if hand.itself and not paper:
            flesh = hand.part.hand
            friction = wishes.coefficient(hand.name, hand.name)
            pairs.append(Pair(flesh.name, flesh.name, friction, f"{hand.name}–{hand.name}", flesh.self_contact()))
            owners.append(PairOf(hand.name, hand.name))
    known = {o.name for o in objects}
    for bonded in wishes.bonds:
        for name in (bonded.one, bonded.other):
            if name not in known:
                raise placed(InputError(f"a bond to nothing: {name} does not deform here"), bonded.where)
    return pairs, owners


def _along_with(known: Prescribed, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far an object goes, axis by axis, whose known degrees of freedom go to these values [m], shape (3,)."""
    change = known.values - displacement.reshape(-1)[known.degrees]
    axes = known.degrees % 3
    return np.array([change[axes == axis].mean() if (axes == axis).any() else 0.0 for axis in range(3)])


def _rigid(before: Places, after: Places, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of a body that goes from one place to another."""
    turn = Rotation.from_quat(after.rotation[0])
    return np.asarray(turn.apply(before.to_local(points)[0]) + after.position[0])
