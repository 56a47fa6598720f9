"""A hand as a deformable body: flesh around bones that follow an animation (R105, R110)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import Body, Material, Prescribed
from warpjld.fem.bone_surfaces import read_bones
from warpjld.fem.hand.alone import FleshAlone
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.cushion import coarse_note
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.hand.laws import hand_laws
from warpjld.simulation.animation import ActorAnimation
from warpjld.simulation.bodies.deformable_body import DeformableBody, History, Surroundings
from warpjld.simulation.bodies.kept_flesh import RestingFlesh, resting_flesh
from warpjld.simulation.bodies.rest_shape import RestShape, cut_to_bones, cut_to_digits
from warpjld.simulation.bodies.segment_surface import SegmentSurface, segment_surface
from warpjld.simulation.bodies.skin_parts import SkinParts, skin_parts
from warpjld.simulation.specification import FleshMaterial, located
from warpjld.skeleton import Poses, Skeleton

__all__ = ["FLESHED", "BoneMotion", "FleshBody", "build_flesh_body", "flesh_body"]

_SIZES = (1.0, 0.96, 0.9, 0.8, 0.68, 0.55)
"""Edges of elements that are tried, over the one that is asked for: where thin parts of a hand would not be meshed,
smaller ones are needed."""
FLESHED = 0.5
"""Share of the flesh in skin from which on it has flesh to give way with."""


@dataclass(frozen=True, eq=False)
class BoneMotion:
    """Joint angles, poses and motions of the bones of a hand at times [frames] from ``start``.

    Attributes:
        hand: Whose bones move.
        animation: What drives them.
        start: Frame of time 0.
        moves: Motions of the bones from the rig's rest at a time.
    """

    hand: FleshHand
    animation: ActorAnimation
    start: float
    moves: Callable[[float], Moves] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        moves = lru_cache(maxsize=8)(lambda time: self.hand.moves(self.pose(time)))
        object.__setattr__(self, "moves", moves)

    @property
    def skeleton(self) -> Skeleton:
        """As the animation has it, limits included."""
        return self.animation.skeleton

    @property
    def bendable(self) -> bool:
        """Whether the joints have angles that a search may change."""
        return self.animation.bendable

    def pose(self, time: float) -> Poses:
        """One pose."""
        return self.animation.pose(self.start + time)

    def angles(self, time: float) -> NDArray[np.float64]:
        """Joint angles [rad], shape (J, 4)."""
        return self.animation.angles(self.start + time)

    def posed(self, angles: NDArray[np.float64], time: float) -> Poses:
        """The pose of other angles (J, 4)."""
        return self.animation.posed(angles, self.start + time)

    def moves_of(self, angles: NDArray[np.float64], time: float) -> Moves:
        """Motions of the bones at other angles (J, 4)."""
        return self.hand.moves(self.posed(angles, time))

    def steps(self, ends: Sequence[tuple[NDArray[np.float64], float]], length: float) -> int:
        """How many steps of at most a length [m] the joints' way takes from angles at a time to others."""
        one, other = (self.posed(angles, time).positions[0] for angles, time in ends)
        return max(1, int(np.ceil(float(np.linalg.norm(other - one, axis=1).max()) / length)))


@dataclass(frozen=True, eq=False, kw_only=True)
class FleshBody(DeformableBody):
    """A hand that is driven by its bones.

    Attributes:
        shape: Its flesh at time 0.
        bones: What moves them.
        parts: Digits and palm of its skin.
        alone: Its flesh without what touches it; one for all copies of the body, since it knows the poses it was in.
        moves: Motions of its bones from the rig's rest at a time.
    """

    shape: RestShape
    bones: BoneMotion
    parts: SkinParts
    alone: FleshAlone
    moves: Callable[[float], Moves]

    @property
    def hand(self) -> FleshHand:
        """Its mesh, with the bones and what they carry."""
        return self.shape.hand

    @property
    def touches_itself(self) -> bool:
        """Whether its skin may touch itself."""
        return self.self_contact is not None

    @property
    def fleshed(self) -> NDArray[np.bool_]:
        """Vertices with flesh to give way with, shape (V,)."""
        return np.asarray(self.shape.blend > FLESHED)

    def has_flesh(self, part: str) -> bool:
        """Whether most of a digit's skin, or the palm's, has flesh to give way with."""
        return bool(self.fleshed[self.parts.mask(part)].mean() > 0.5)

    def deformed(self, displacement: NDArray[np.float64], covered: NDArray[np.floating] | None) -> NDArray[np.float64]:
        """Its skin [m], shape (V, 3): under a displacement (N, 3), as ``covered`` (V, 3) where it has no flesh."""
        assert covered is not None
        return self.shape.deformed(displacement, covered)

    def prescribed(self, time: float, history: History | None = None) -> Prescribed:
        """Displacements of the bones' nodes and of those where the flesh was cut off."""
        return _held_by_bones(self.shape, self.moves(time))

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings | None = None
    ) -> NDArray[np.float64]:
        """First guess of a displacement (N, 3): flesh carried along by its bones."""
        start = self.shape.start
        return self.hand.guess(start.to(self.moves(before)), start.to(self.moves(time)), displacement)

    def carry(self, before: float, time: float, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where points (n, 3) [m] go that go along with the hand as a whole."""
        return self.moves(before).to(self.moves(time)).of(np.zeros(len(points), np.int64), points)

    def way(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Where nodes are, and are expected to be [m]."""
        rest, first = self.mesh.nodes[nodes], times[0]
        return [rest + (displacement if t == first else self.guess(first, t, displacement))[nodes] for t in times]

    def timed(self, clock: Callable[[float], float]) -> Self:
        """The same hand, driven as it is at ``clock(time)``."""
        moves = self.moves
        return replace(self, moves=lambda time: moves(clock(time)))

    def driven(self, animation: ActorAnimation) -> Self:
        """The same hand, driven by an animation of the same actor with edits laid over it."""
        bones = replace(self.bones, animation=animation)
        return replace(self, bones=bones, moves=bones.moves)


def build_flesh_body(actor: ActorAnimation, material: FleshMaterial, start: float) -> tuple[FleshBody, list[str]]:
    """An actor's flesh, in the shape it has at a frame, and notes on its mesh.

    Raises:
        InputError: It cannot be meshed in that pose; names the line of its FLESH.
    """
    poses, skin, notes = actor.pose(start), actor.skin(start), []
    flesh, element, part = _meshed(actor, material, poses, skin)
    notes += [f"{actor.name}: {note}" for note in flesh.notes]
    if element != material.element:
        notes.append(
            f"{actor.name}: elements of {1e3 * element:.3g} mm, {1e3 * material.element:g} mm make no good mesh"
        )
    if (coarse := coarse_note(flesh.cushions, element, material.digits)) is not None:
        notes.append(f"{actor.name}: {coarse}")
    gap = flesh.gap if part is None else part.gap(flesh.hand, skin, part.ends(flesh.built, element))
    if gap > 0.5 * element:
        notes.append(f"{actor.name}: the volume stays up to {1e3 * gap:.1f} mm off the skin where it folds")
    built = flesh.built
    if part is None:
        shape = cut_to_digits(flesh.hand, poses, skin, material.digits)
    else:
        ends, built, hand = part.ends(built, element), part.widened(built), part.widened(flesh.hand)
        shape = cut_to_bones(hand, poses, skin, part.bones(hand), part.share, ends)
    laws = hand_laws(
        shape.hand.mesh.region_names,
        flesh=material.flesh,
        skin=material.skin,
        poisson=material.poisson,
        stiffening=material.stiffening,
    )
    bones = BoneMotion(shape.hand, actor, start)
    return flesh_body(actor.name, shape, laws, material, bones, skin_parts(built)), notes


def _meshed(
    actor: ActorAnimation, material: FleshMaterial, poses: Poses, skin: NDArray[np.float64]
) -> tuple[RestingFlesh, float, SegmentSurface | None]:
    """A hand where its rig rests and in a pose, its elements' edge [m], and the segments it was cut to.

    Whether some element at a cut or between two digits comes out distorted hangs on where the grid happens to lie: a
    grid a little finer has it elsewhere. Thin parts want smaller elements.

    Raises:
        InputError: It cannot be meshed at any of these sizes: what was wrong with the one that was asked for.
    """
    failure: InputError | None = None
    for share in _SIZES:
        element = share * material.element
        bones = () if material.bones is None else read_bones(material.bones, actor.rig)
        try:
            if not material.segments:
                return resting_flesh(actor.rig, element, actor.name.lower(), poses, skin, bones), element, None
            part = segment_surface(actor.rig, actor.covering, material.segments, element)
            return (
                resting_flesh(part.rig, element, actor.name.lower(), poses, skin[part.vertices], bones),
                element,
                part,
            )
        except InputError as error:
            failure = failure or error
    assert failure is not None
    what = failure.message.replace("spacing:", "ELEMENT:")
    raise located(InputError(f"FLESH {actor.name}: {what}"), material.where) from failure


def flesh_body(
    name: str,
    shape: RestShape,
    laws: Mapping[str, Material],
    material: FleshMaterial,
    bones: BoneMotion,
    parts: SkinParts,
) -> FleshBody:
    """A hand of that shape at rest, with its laws, what moves its bones, and the parts of its whole skin."""
    hand, degrees = shape.hand, _held_by_bones(shape, bones.moves(0.0)).degrees
    return FleshBody(
        name=name,
        mesh=hand.mesh,
        faces=hand.name,
        laws=laws,
        modulus=material.skin,
        stress=np.zeros((len(hand.mesh.elements), 6)),
        surface=shape.skin,
        triangles=hand.surface.faces,
        embedding=hand.flesh.skin,
        embedded=np.asarray(shape.blend > 0.0),
        self_contact=hand.self_contact() if material.itself else None,
        parts=parts,
        pressing=(shape.blend > FLESHED) & material.itself,
        shape=shape,
        bones=bones,
        alone=FleshAlone(hand, Body(hand.mesh, laws), degrees, bones.pose(0.0)),
        moves=bones.moves,
    )


def _held_by_bones(shape: RestShape, motion: Moves) -> Prescribed:
    """Displacements of the bones' nodes and of those where the flesh was cut off, under motions from the rig's rest."""
    moves = shape.start.to(motion)
    known = shape.hand.prescribed_by(moves)
    cut = np.setdiff1d(shape.cut, known.degrees[::3] // 3)
    if not len(cut):
        return known
    x = shape.hand.mesh.nodes[cut]
    return known + _whole(cut, moves.blended(shape.hand.weights[cut], x) - x)


def _whole(nodes: NDArray[np.int64], moved: NDArray[np.float64]) -> Prescribed:
    """All three displacements of nodes."""
    order = np.argsort(nodes)
    degrees = (3 * nodes[order][:, None] + np.arange(3)).ravel()
    return Prescribed(degrees, moved[order].ravel())
