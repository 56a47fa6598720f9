"""Grasp search with two hands for objects too wide for one: palms opposed across the object (A §10, R90)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.grasp.close import Closed, Closer
from warpjld.grasp.find_grasp import AutoGrasp
from warpjld.grasp.judge import Judge, Pressing, Verdict, check_friction
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.obstacles import Obstacles
from warpjld.grasp.palm import palm_of
from warpjld.grasp.placements import Candidates, around, palms_on
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.random_placements import WAY, preference
from warpjld.grasp.widths import Widths, sample_widths
from warpjld.skeleton import CHANNELS, DIGITS, Skeleton, poses_from_angles
from warpjld.skeleton.channels import FLEXION

__all__ = ["find_two_handed"]

_SIDES = ("left", "right")
_LINES = 400  # random lines through the object, to find opposite sides
_ROUND = 24  # placements per round (batch)
_DEEPEST = 6e-4  # largest penetration of hands and object in a grasp that is accepted [m]
_APART = 5e-3  # smallest distance between the skins of the two hands [m]
_BACK = np.radians(30.0)  # extension of the fingers while the palm approaches [rad]
_COMES = (0.0, 0.1, 0.3, 0.6, 1.0)  # distances back along the approach, in units of WAY, at which collisions are tested


@dataclass(frozen=True, eq=False)
class _Side:
    """One of the two hands with its search structures for the object."""

    name: str
    closer: Closer
    judge: Judge
    around: Obstacles

    def closed(self, aim: NDArray[np.float64], look: NDArray[np.float64], fingers: NDArray[np.float64]) -> _Ended:
        """Place G hands by palm centre, palm normal and direction of the fingers, each (G, 3), and close them."""
        covering = self.closer.covering
        skeleton = covering.skeleton
        hands = palms_on(
            covering, bent_back(covering.skeleton, self.name), self.closer.both.near, self.name, aim, look, fingers
        )
        digits = [f"{self.name}.{digit}" for digit in self.judge.digits]
        closed = self.closer.close(hands.poses(skeleton), hands.angles, digits=digits, coupling=(1.0, 0.7))
        poses = hands.poses(skeleton, closed.angles)
        skins = covering.deform(poses, threads=1)
        clear = np.ones(len(hands), dtype=bool)
        if self.around:
            opened = covering.deform(hands.poses(skeleton), threads=1)
            shifts = -WAY * hands.approach[:, None]
            ways = [opened + (part * shifts).astype(np.float32) for part in _COMES]
            clear = np.all([self.around.missed(way) for way in (*ways, skins)], axis=0)
        return _Ended(hands, closed, skins, self.judge.pressing(poses, skins), clear)


def bent_back(skeleton: Skeleton, side: str) -> NDArray[np.float64]:
    """Angles of a hand whose digits are bent back, so that its palm is what meets an object first [rad], (J, 4).

    Fingers bend back at their base by 30°; the thumb is turned to where its joints lie least before the palm, of the
    ends of its base joint's ranges."""
    angles = skeleton.initial.copy()
    there = {digit: f"{side}.{digit}.base" for digit in DIGITS if f"{side}.{digit}.base" in skeleton.names}
    for name in (name for digit, name in there.items() if digit != "thumb"):
        row = skeleton.index(name)
        angles[row, FLEXION] = max(angles[row, FLEXION] - _BACK, skeleton.limits[row, FLEXION, 0])
    if "thumb" not in there:
        return angles
    row = skeleton.index(there["thumb"])
    ends = np.column_stack([skeleton.limits[row], angles[row]])
    tried = np.repeat(angles[None], 3 ** len(CHANNELS), axis=0)
    tried[:, row] = list(product(*ends))
    chain = [skeleton.index(name) for name in skeleton.names if name.startswith(f"{side}.thumb.")]
    ahead = poses_from_angles(skeleton, tried).positions[:, chain] @ palm_of(skeleton, side).normal
    return np.asarray(tried[ahead.max(axis=1).argmin()])


@dataclass(frozen=True, eq=False)
class _Ended:
    """Results of one hand in G placements.

    Attributes:
        hands: The open hands.
        closed: The closed hands.
        skins: Their skins [m], shape (G, V, 3).
        pressing: Their contacts that can press.
        clear: Mask of those that enter no obstacle, shape (G,).
    """

    hands: Candidates
    closed: Closed
    skins: NDArray[np.float32]
    pressing: list[Pressing]
    clear: NDArray[np.bool_]


def find_two_handed(
    hands: Mapping[str, Covering],
    thing: GraspObject,
    *,
    obstacles: Sequence[GraspObject] = (),
    count: int = 96,
    friction: float = 0.6,
    seed: int = 0,
    device: str = "cpu",
) -> dict[str, AutoGrasp]:
    """Find a grasp with two hands: place them on opposite sides of the object, close, judge both together.

    The palms face one another along a line through the object whose ends lie within the friction cones; the fingers of
    both point in the same direction. Fingers are extended until a palm
    touches the object, and then close. A grasp is accepted if the contacts of both hands together are force closed,
    both hands press, neither penetrates the object by more than 0.6 mm, and the hands stay 5 mm apart. Grasps in which
    both palms are in contact rank above those held by fingers alone.

    Args:
        hands: The hands by side, ``left`` and ``right``, smooth method.
        thing: The object at its own placement.
        obstacles: Other objects at their placements.
        count: Largest number of placements.
        friction: Coulomb coefficient.
        seed: Seed of the random numbers.
        device: Warp device, see ``Closer``.

    Returns:
        The grasp of each side; both have the verdict on the two together. Their posture is ``palms`` if both palms are
        in contact, else ``fingers``.

    Raises:
        InputError: A side is missing, the object has no opposite sides, or no placement led to a grasp.
    """
    if sorted(hands) != sorted(_SIDES):
        raise InputError(f"hands: want a left and a right one, got {', '.join(hands) or 'none'}")
    if count < 1:
        raise InputError(f"count: want 1 or more, got {count}")
    check_friction(friction)
    sides = [_side(name, hands[name], thing, obstacles, friction, device) for name in _SIDES]
    rng = np.random.default_rng(seed)
    near = sides[0].closer.both.near
    widths = sample_widths(near, _LINES, rng, widest=float(np.linalg.norm(thing.size)))
    widths = widths[np.flatnonzero(widths.slant >= np.cos(np.arctan(friction)))]
    if not len(widths):
        raise InputError(
            f"object {thing.name}: nowhere has it two sides that friction {friction:g} holds between palms"
        )
    best: dict[str, AutoGrasp] = {}
    tried = 0
    while tried < count and not (best and 2 * tried >= count):
        batch = min(_ROUND, count - tried)
        tried += batch
        ended = _placed(sides, widths, near.thing, batch, rng)
        for g in range(batch):
            verdict = _together(sides, ended, g, friction)
            if verdict is not None and _rank(verdict) > (_rank(best["left"].verdict) if best else (False, 0.0)):
                best = {side.name: _grasp(side, one, g, verdict, tried) for side, one in zip(sides, ended, strict=True)}
    if not best:
        widest = 1e3 * float(widths.width.max())
        raise InputError(
            f"object {thing.name}: none of {tried} placements of two hands ends in a grasp that holds at friction "
            f"{friction:g}; between palms it is up to {widest:.0f} mm wide"
        )
    return best


def _side(
    name: str, covering: Covering, thing: GraspObject, obstacles: Sequence[GraspObject], friction: float, device: str
) -> _Side:
    closer = Closer(covering, thing, device=device)
    return _Side(name, closer, Judge(closer.both, name, friction), Obstacles(covering, obstacles))


def _placed(
    sides: list[_Side], widths: Widths, thing: GraspObject, count: int, rng: np.random.Generator
) -> list[_Ended]:
    """Place and close both hands at the ends of random widths, preferably near the centre of mass."""
    picked = widths[rng.choice(len(widths), size=count, p=preference(widths, thing))]
    line = unit(picked.second - picked.first)
    fingers, turned = around(line, rng), rng.random(count)[:, None] < 0.5
    aims = np.where(turned, picked.second, picked.first), np.where(turned, picked.first, picked.second)
    looks = np.where(turned, -line, line), np.where(turned, line, -line)
    return [side.closed(aim, look, fingers) for side, aim, look in zip(sides, aims, looks, strict=True)]


def _together(sides: list[_Side], ended: list[_Ended], g: int, friction: float) -> Verdict | None:
    """Verdict on both hands together; None where one does not press, penetrates, is blocked, or is near the other."""
    pressing = [one.pressing[g] for one in ended]
    if not all(len(one.contacts) for one in pressing) or not all(one.clear[g] for one in ended):
        return None
    depth = max(max(float(one.closed.penetration[g]), one.pressing[g].depth) for one in ended)
    if depth > _DEEPEST:
        return None
    distance, _ = cKDTree(ended[0].skins[g]).query(ended[1].skins[g], distance_upper_bound=_APART)
    if np.isfinite(distance).any():
        return None
    several = [one.contacts for one in pressing]
    contacts = Contacts(
        np.concatenate([one.points for one in several]),
        np.concatenate([one.normals for one in several]),
        np.array(friction),
        np.concatenate([one.spin for one in several]),
    )
    digits = tuple(f"{side.name}.{name}" for side, one in zip(sides, pressing, strict=True) for name in one.digits)
    return sides[0].judge.verdict(contacts, digits, all(one.palm for one in pressing), depth)


def _rank(verdict: Verdict) -> tuple[bool, float]:
    """Rank of a grasp: both palms in contact before fingers alone, then by score."""
    return verdict.closed and verdict.palm, verdict.score


def _grasp(side: _Side, ended: _Ended, g: int, verdict: Verdict, tried: int) -> AutoGrasp:
    hands = ended.hands
    touching = tuple(name for name in verdict.digits if name.startswith(f"{side.name}."))
    place = hands.position[g], hands.rotation[g], hands.approach[g], hands.angles[g]
    posture = "palms" if verdict.palm else "fingers"
    return AutoGrasp(posture, *place, ended.closed.angles[g], verdict, touching, tried)
