"""Judgement of closed hands: contacts that can press, force closure, epsilon quality, penetration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.quality.closure import closure_margins
from warpjld.grasp.quality.contacts import Contacts, patch_spin
from warpjld.grasp.quality.touch import ContactPatches
from warpjld.grasp.quality.wrench_space import least_resistance, least_resistances
from warpjld.grasp.segments import SEGMENTS, vertex_segments
from warpjld.grasp.subdivided_skin import FinerSkin
from warpjld.grasp.touching import touching_patches
from warpjld.skeleton import DIGITS, Poses

__all__ = ["Judge", "Pressing", "Verdict", "check_friction", "hand_side", "judge"]

_TOUCH = 5e-4  # largest distance that counts as contact [m]
_NEARLY = 2.5e-3  # the same when ranking hands that closed roughly [m]
_SPACING = 1.5e-3  # spacing of the sample points on the skin [m]
_EDGES = 8  # edges of the friction cones
_NOTHING = Contacts(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
_STILL = 1e-9  # way of a contact [m] below which closing does not move it
_DIGIT = 0.01  # bonus to the score for every digit in contact [N]


@dataclass(frozen=True)
class Verdict:
    """Judgement of one closed hand.

    Attributes:
        closed: Whether the contacts that can press make the grasp force closed.
        epsilon: Ferrari–Canny epsilon of these contacts [N], norm L1, torques divided by the object's largest radius.
        digits: Digits that press, thumb included, e.g. ``thumb``.
        palm: Whether the palm presses.
        depth: Penetration depth of hand and object [m], see ``HandObjectGaps``.
        tightening: Epsilon if each contact presses with only as much of its force as closing its digit presses it [N];
            equal to ``epsilon`` where it is not known how digits close.
    """

    closed: bool
    epsilon: float
    digits: tuple[str, ...]
    palm: bool
    depth: float
    tightening: float = 0.0

    def __repr__(self) -> str:
        held = "force closed" if self.closed else "not force closed"
        by = ", ".join([*self.digits, *(["palm"] if self.palm else [])]) or "nothing"
        return f"Verdict({held}, epsilon {self.epsilon:.3f} N, {by} presses, depth {1e3 * self.depth:.2f} mm)"

    @property
    def score(self) -> float:
        """Score [N]: epsilon + 0.01 N per pressing digit where the grasp is force closed, else 0."""
        return self.epsilon + _DIGIT * len(self.digits) if self.closed else 0.0

    @property
    def firmness(self) -> float:
        """Score [N] of a grasp that is to be tightened: as ``score``, of contacts pressed by closing their digits."""
        return self.tightening + _DIGIT * len(self.digits) if self.closed else 0.0


@dataclass(frozen=True, eq=False)
class Pressing:
    """Contacts of one hand that can press on the object.

    Attributes:
        contacts: The contacts in the object's frame.
        digits: Digits that press, without side.
        palm: Whether the palm presses.
        depth: Depth of the skin's deepest point in the object [m].
        straight: Cosine of the object's normal and the way of each contact as all joints of its digit flex alike, at
            least 0, shape (C,): a contact that closing moves along the surface is not pressed by it. 1 for the palm,
            and where it is not known how digits close.
    """

    contacts: Contacts
    digits: tuple[str, ...]
    palm: bool
    depth: float
    straight: NDArray[np.float64]


class Judge:
    """Judges hands that closed on an object.

    Only contacts on the palmar side of digits and palm count, where the contact's skin normal does not point to the
    back of the hand: a hand cannot press with the back of a digit.

    Args:
        both: Distances between hand and object, which is at its own placement.
        side: ``left`` or ``right``.
        friction: Coulomb coefficient.

    Attributes:
        digits: Names of the hand's digits, without side.
    """

    def __init__(self, both: HandObjectGaps, side: str, friction: float) -> None:
        covering, thing = both.covering, both.thing
        self.both, self.friction = both, friction
        there = digit_chains(covering.skeleton)
        self.digits = [digit for digit in DIGITS if f"{side}.{digit}" in there]
        self._center = thing.centroid
        self._radius = float(np.linalg.norm(thing.vertices - thing.centroid, axis=1).max())
        self._skin, self._finer = kept_with(covering, _skin), kept_with(covering, _finer_skin)
        self._segments = vertex_segments(covering, side)
        skeleton = covering.skeleton
        joints = [f"{side}.{name}" if name != "palm" else f"{side}.middle.base" for name in SEGMENTS]
        self._joints = np.array([skeleton.names.index(name) if name in skeleton.names else 0 for name in joints])
        # segment × flexion axis points to the back of the hand (R20)
        self._inner = -np.cross(skeleton.directions[self._joints], skeleton.axes[self._joints])
        palm = skeleton.names.index(f"{side}.wrist")
        self._joints[-1] = palm

    def first_look(self, poses: Poses, vertices: NDArray[np.floating]) -> NDArray[np.float64]:
        """Rank hands that closed roughly, shape (G,): larger is better, 0 and below means not promising.

        −1 without two digits and either thumb or palm; else closure margin + 0.04 per digit + 0.1 if force closed
        − 50 per metre of depth beyond 1 mm. The weights are chosen by hand.
        """
        hands = self._pressing(poses, *self._patches(self._skin, vertices, _NEARLY))
        ranks = np.full(len(hands), -1.0)
        kept = [g for g, hand in enumerate(hands) if ("thumb" in hand.digits or hand.palm) and len(hand.digits) > 1]
        of_kept = [hands[g].contacts for g in kept]
        margins = closure_margins(of_kept, self._center, torque_scale=self._radius, edges=6)
        for g, margin in zip(kept, margins.tolist(), strict=True):
            deep = max(0.0, hands[g].depth - 1e-3)
            ranks[g] = margin + 0.04 * len(hands[g].digits) + 0.1 * (margin > 0.0) - 50.0 * deep
        return ranks

    def judge(
        self,
        poses: Poses,
        vertices: NDArray[np.floating],
        depths: NDArray[np.float64],
        further: Poses | None = None,
    ) -> list[Verdict]:
        """Judge G hands.

        Args:
            poses: The closed hands.
            vertices: Their deformed skins [m], shape (G, V, 3).
            depths: Penetration depths of hands and object [m], see ``HandObjectGaps``, shape (G,).
            further: The hands with all joints that close flexed further, alike, by a little.
        """
        hands = self.pressing(poses, vertices, further)
        contacts, shares = [hand.contacts for hand in hands], [hand.straight for hand in hands]
        epsilons, tightenings = (
            least_resistances(contacts, self._center, torque_scale=self._radius, edges=_EDGES, shares=share)
            for share in (None, shares)
        )
        return [
            Verdict(epsilon > 0.0, epsilon, hand.digits, hand.palm, max(float(depth), hand.depth), tightening)
            for hand, epsilon, depth, tightening in zip(hands, epsilons, depths, tightenings, strict=True)
        ]

    def pressing(self, poses: Poses, vertices: NDArray[np.floating], further: Poses | None = None) -> list[Pressing]:
        """Contacts that can press, of G closed hands with skins (G, V, 3) [m]; ``further`` as in ``judge``."""
        return self._pressing(poses, *self._patches(self._finer, vertices, _TOUCH), further)

    def verdict(self, contacts: Contacts, digits: tuple[str, ...], palm: bool, depth: float) -> Verdict:
        """Judge contacts in the object's frame; they are force closed where epsilon is above 0."""
        epsilon = least_resistance(contacts, self._center, torque_scale=self._radius, edges=_EDGES)
        return Verdict(epsilon > 0.0, epsilon, digits, palm, depth)

    def _patches(
        self, finer: FinerSkin, vertices: NDArray[np.floating], tolerance: float
    ) -> tuple[list[ContactPatches], NDArray[np.float64]]:
        """Contact patches in the object's frame and depth of the skin's deepest point [m], for every hand."""
        place, parts = self.both.thing.place, self._segments[finer.parents]
        local = place.to_local(vertices.reshape(-1, 3))[0].reshape(vertices.shape)
        return touching_patches(finer, parts, self.both.near, local, tolerance)

    def _pressing(
        self,
        poses: Poses,
        patches: list[ContactPatches],
        depths: NDArray[np.float64],
        further: Poses | None = None,
    ) -> list[Pressing]:
        """What presses of the patches of every hand."""
        names = [name for own in patches for name in own.names]
        if not names:
            return [Pressing(_NOTHING, (), False, float(depth), np.zeros(0)) for depth in depths]
        rows = np.array([SEGMENTS.index(name) for name in names])
        hand = np.repeat(np.arange(len(patches)), [len(own) for own in patches])
        points, normals, facing, areas = (
            np.concatenate([getattr(own, what) for own in patches])
            for what in ("points", "normals", "skin_normals", "areas")
        )
        own = Rotation.from_quat(self.both.thing.place.rotation[0]).inv()
        turns = own * Rotation.from_quat(poses.rotations[hand, self._joints[rows]])
        kept = (turns.apply(self._inner[rows]) * facing).sum(axis=1) > 0.0
        contacts = Contacts(points, normals, np.array(self.friction), patch_spin(self.friction, areas))
        straight = self._straight(poses, further, hand, rows, points, normals)
        digits = [name.partition(".")[0] for name in names]
        ends = np.searchsorted(hand, np.arange(len(patches) + 1))
        out = []
        for first, end, depth in zip(ends[:-1], ends[1:], depths.tolist(), strict=True):
            its = first + np.flatnonzero(kept[first:end])
            pressing = [digits[k] for k in its]
            fingers = tuple(dict.fromkeys(name for name in pressing if name != "palm"))
            out.append(Pressing(contacts[its], fingers, "palm" in pressing, depth, straight[its]))
        return out

    def _straight(
        self,
        poses: Poses,
        further: Poses | None,
        hand: NDArray[np.integer],
        rows: NDArray[np.integer],
        points: NDArray[np.float64],
        normals: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """``Pressing.straight`` of patches (n,) of hands, on segments ``rows``, in the object's frame; 1 for parts that
        do not move, or without ``further``."""
        if further is None:
            return np.ones(len(rows))
        place, joints = self.both.thing.place, self._joints[rows]
        there = place.apply(points)[0]
        turn = (
            Rotation.from_quat(further.rotations[hand, joints])
            * Rotation.from_quat(poses.rotations[hand, joints]).inv()
        )
        way = further.positions[hand, joints] + turn.apply(there - poses.positions[hand, joints]) - there
        far = np.linalg.norm(way, axis=1)
        along = (way * Rotation.from_quat(place.rotation[0]).apply(normals)).sum(axis=1)
        return np.asarray(np.maximum(np.divide(along, far, out=np.ones(len(far)), where=far > _STILL), 0.0))


def judge(
    covering: Covering, thing: GraspObject, poses: Poses, *, side: str | None = None, friction: float = 0.6
) -> list[Verdict]:
    """Judge how closed hands hold an object: contacts that can press, force closure, epsilon, penetration.

    Args:
        covering: The hand, smooth method.
        thing: The object at its own placement.
        poses: Closed hands, one per frame.
        side: ``left`` or ``right``; may be left out for a single hand.
        friction: Coulomb coefficient.

    Returns:
        One verdict per frame.

    Raises:
        InputError: No such hand, or a coefficient that is not positive.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering, ball = wj.bind(hand), wj.shapes.ball(0.06)
        >>> grasp = wj.find_grasp(covering, ball, count=32)
        >>> (verdict,) = wj.judge(covering, ball, grasp.poses(hand.skeleton))
        >>> verdict.closed, verdict.depth < 1e-3  # m
        (True, True)
    """
    side = hand_side(covering, side)
    check_friction(friction)
    both = HandObjectGaps(covering, thing)
    skins = covering.deform(poses)
    depths = both.depths(skins).max(axis=1)
    return Judge(both, side, friction).judge(poses, skins, depths)


def hand_side(covering: Covering, side: str | None) -> str:
    """Side of a hand of the covering: ``side`` if there is such a hand, or that of the only one if it is None.

    Raises:
        InputError: No such hand, or two of them.
    """
    sides = [s for s in ("left", "right") if f"{s}.middle.base" in covering.skeleton.names]
    wanted = side or (sides[0] if len(sides) == 1 else "")
    if wanted not in sides:
        raise InputError(f"side: want one of {', '.join(sides) or 'a hand'}, got '{wanted}'")
    return wanted


def check_friction(friction: float) -> None:
    """Check a coefficient of friction.

    Raises:
        InputError: It is not a finite number above 0.
    """
    if not (np.isfinite(friction) and friction > 0.0):
        raise InputError(f"friction: want a number above 0, got {friction:g}")


def _skin(covering: Covering) -> FinerSkin:
    return FinerSkin(covering.surface.vertices, covering.surface.faces, np.inf)


def _finer_skin(covering: Covering) -> FinerSkin:
    return FinerSkin(covering.surface.vertices, covering.surface.faces, _SPACING)
