"""Hand as a deformable body: flesh driven by bones that follow an animation (R105, R110)."""

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
from warpjld.simulation.bodies.skin_parts import SkinParts, digit_of_label, skin_parts
from warpjld.simulation.specification import FleshMaterial, located
from warpjld.skeleton import Poses, Skeleton

__all__ = ["FLESHED", "BoneMotion", "FleshBody", "build_flesh_body", "flesh_body"]

_SIZES = (1.0, 0.96, 0.9, 0.8, 0.68, 0.55)
"""Element edges tried in turn, as fractions of the requested one: thin parts of a hand need smaller elements."""
FLESHED = 0.5
"""Blend of finite elements and covering above which a skin vertex counts as having deformable flesh."""


@dataclass(frozen=True, eq=False)
class BoneMotion:
    """Joint angles, poses and rigid motions of a hand's bones over time [frames from ``start``].

    Attributes:
        hand: Hand with the bones.
        animation: Animation of the actor.
        start: Frame of time 0.
        moves: Rigid motions of the bones from the rig's rest pose at a time.
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
        """Skeleton with the axes and limits of the animation."""
        return self.animation.skeleton

    @property
    def bendable(self) -> bool:
        """Whether it is driven by joint angles, which searches may change."""
        return self.animation.bendable

    def pose(self, time: float) -> Poses:
        """Pose at a time."""
        return self.animation.pose(self.start + time)

    def angles(self, time: float) -> NDArray[np.float64]:
        """Joint angles at a time [rad], shape (J, 4)."""
        return self.animation.angles(self.start + time)

    def posed(self, angles: NDArray[np.float64], time: float) -> Poses:
        """Pose of given angles (J, 4), with the root of a time."""
        return self.animation.posed(angles, self.start + time)

    def moves_of(self, angles: NDArray[np.float64], time: float) -> Moves:
        """Rigid motions of the bones at given angles (J, 4)."""
        return self.hand.moves(self.posed(angles, time))

    def steps(self, ends: Sequence[tuple[NDArray[np.float64], float]], length: float) -> int:
        """Number of steps between two pairs of angles and time in which no joint moves farther than ``length`` [m]."""
        first, last = (self.posed(angles, time).positions[0] for angles, time in ends)
        return max(1, int(np.ceil(float(np.linalg.norm(last - first, axis=1).max()) / length)))


@dataclass(frozen=True, eq=False, kw_only=True)
class FleshBody(DeformableBody):
    """A hand driven by its bones.

    Attributes:
        shape: Its flesh at time 0.
        bones: Motion of its bones.
        parts: Digits and palm of its skin.
        alone: Its flesh without contact; shared by all copies of the body, since it caches equilibria by pose.
        moves: Rigid motions of its bones from the rig's rest pose at a time.
    """

    shape: RestShape
    bones: BoneMotion
    parts: SkinParts
    alone: FleshAlone
    moves: Callable[[float], Moves]

    @property
    def hand(self) -> FleshHand:
        """Mesh, bones and weights of the hand."""
        return self.shape.hand

    @property
    def touches_itself(self) -> bool:
        """Whether self-contact of its skin is considered."""
        return self.self_contact is not None

    @property
    def node_digits(self) -> NDArray[np.str_]:
        """Digit of every node, or ``palm``; empty for inner nodes, shape (N,)."""
        labels = [digit_of_label(name) for name in self.hand.label_names]
        return np.array([*labels, ""])[self.hand.node_labels]

    @property
    def fleshed(self) -> NDArray[np.bool_]:
        """Mask of the skin vertices with deformable flesh, shape (V,)."""
        return np.asarray(self.shape.blend > FLESHED)

    def has_flesh(self, part: str) -> bool:
        """Whether most of the skin of a digit or the palm has deformable flesh."""
        return bool(self.fleshed[self.parts.mask(part)].mean() > 0.5)

    def deformed(self, displacement: NDArray[np.float64], covered: NDArray[np.floating] | None) -> NDArray[np.float64]:
        """Skin [m], shape (V, 3), under a displacement (N, 3); equal to ``covered`` (V, 3) where it has no flesh."""
        assert covered is not None
        return self.shape.deformed(displacement, covered)

    def shown(
        self,
        displacement: NDArray[np.float64],
        covered: NDArray[np.floating],
        time: float,
        smoothed: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """As ``deformed``, where ``smoothed`` smooths what the flesh adds to the motion of the bones at a time."""
        return self.shape.deformed(displacement, covered, smoothed, self.moves(time))

    def prescribed(self, time: float, history: History | None = None) -> Prescribed:
        """Displacements of the bones' nodes and of the cut nodes."""
        return _held_by_bones(self.shape, self.moves(time))

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings | None = None
    ) -> NDArray[np.float64]:
        """Predictor: displacement (N, 3) of flesh that moves along with its bones."""
        start = self.shape.start
        return self.hand.guess(start.to(self.moves(before)), start.to(self.moves(time)), displacement)

    def carry(self, before: float, time: float, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) [m] moved rigidly with the hand's first bone from one time to another."""
        return self.moves(before).to(self.moves(time)).of(np.zeros(len(points), np.int64), points)

    def path(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Current and predicted positions of nodes [m]."""
        rest, first = self.mesh.nodes[nodes], times[0]
        return [rest + (displacement if t == first else self.guess(first, t, displacement))[nodes] for t in times]

    def timed(self, clock: Callable[[float], float]) -> Self:
        """A copy whose bones at ``time`` are where this hand's are at ``clock(time)``."""
        moves = self.moves
        return replace(self, moves=lambda time: moves(clock(time)))

    def driven(self, animation: ActorAnimation) -> Self:
        """A copy driven by an edited animation of the same actor."""
        bones = replace(self.bones, animation=animation)
        return replace(self, bones=bones, moves=bones.moves)


def build_flesh_body(actor: ActorAnimation, material: FleshMaterial, start: float) -> tuple[FleshBody, list[str]]:
    """Mesh an actor's flesh in its pose at a frame; returns the body and notes on its mesh.

    Raises:
        InputError: It cannot be meshed in that pose; names the line of its FLESH command.
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
        try:
            shape = cut_to_digits(flesh.hand, poses, skin, material.digits)
        except InputError as error:
            file = (
                "" if material.bones is None else f": want some in {material.bones.name}, in the rig's units and axes"
            )
            raise located(InputError(f"{error.message}{file}"), material.where) from error
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
    """Flesh meshed at the rig's rest and moved to a pose, its element edge [m], and the skin of its segments, if any.

    Whether elements at a cut or between two digits are distorted depends on the position of the grid, so slightly
    finer grids are tried in turn. Thin parts need smaller elements.

    Raises:
        InputError: No size succeeds; gives the failure at the requested size.
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
    """Assemble a flesh body from its rest shape, constitutive laws, bone motion and the parts of its whole skin."""
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
    """Displacements of bone nodes and cut nodes under rigid motions of the bones from the rig's rest pose."""
    moves = shape.start.to(motion)
    known = shape.hand.prescribed_by(moves)
    cut = np.setdiff1d(shape.cut, known.degrees[::3] // 3)
    if not len(cut):
        return known
    x = shape.hand.mesh.nodes[cut]
    return known + _all_axes(cut, moves.blended(shape.hand.weights[cut], x) - x)


def _all_axes(nodes: NDArray[np.int64], moved: NDArray[np.float64]) -> Prescribed:
    """Dirichlet conditions for all three components of nodes (n,) with displacements (n, 3) [m]."""
    order = np.argsort(nodes)
    degrees = (3 * nodes[order][:, None] + np.arange(3)).ravel()
    return Prescribed(degrees, moved[order].ravel())
