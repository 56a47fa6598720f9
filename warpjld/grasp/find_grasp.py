"""Automatic grasp search: sample placements of an open hand, close it, judge the result, keep the best (A §10, R90)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.close import Closed, Closer
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.idle_fingers import idle_fingers_relaxed
from warpjld.grasp.judge import Judge, Verdict, check_friction, hand_side
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.obstacles import COLLIDES, Obstacles
from warpjld.grasp.placements import Candidates
from warpjld.grasp.postures import posture_for
from warpjld.grasp.random_placements import Draws
from warpjld.grasp.refusal import fault_of, refuse_what_is_too_wide
from warpjld.skeleton import Poses, Skeleton
from warpjld.skeleton.channels import FLEXION

__all__ = ["AutoGrasp", "check_opposing", "find_grasp"]

_ROUND = 32  # placements per round (batch)
_FINALISTS = 6  # placements of a round that are closed and judged in full
_DEEPEST = 6e-4  # largest penetration of hand and object in a grasp that is accepted [m]
_PRESSED = 3e-4  # penetration above which an open hand is moved back along its approach [m]
_GOOD = 0.12  # firmness at which the search may end early [N]
_AS_WELL = 0.95  # score over that before idle fingers open, above which the grasp counts as one that holds as well
_LITTLE = 1e-4  # flexion of all joints that tells how closing moves contacts [rad]
_FOLLOWS = (0.5, 0.25, 0.0)  # flexion of a finger that takes no part, over that of the finger beside it, tried in turn
_OTHERS = ("plate", "cylinder", "sphere", "pinch")  # further postures, tried in turn while nothing is found
_CLOSES = (0.0, 0.25, 0.5, 0.75, 1.0)  # fractions of the closing motion at which collisions are tested


@dataclass(frozen=True, eq=False)
class AutoGrasp:
    """Result of ``find_grasp``: the best grasp found.

    Attributes:
        posture: Name of the open posture it was closed from, one of ``POSTURES``.
        position: Displacement of the skeleton's root [m], shape (3,).
        rotation: Rotation of the root about its rest place, x y z w, shape (4,).
        approach: Unit direction in which the open hand moved to its placement, shape (3,).
        start: Angles of the open hand [rad], shape (J, 4).
        angles: Angles of the closed hand [rad], shape (J, 4).
        verdict: Contacts, force closure, epsilon and penetration of the closed hand.
        touching: Names of the digits that press, e.g. ``left.index``.
        tried: Number of placements that were closed.
    """

    posture: str
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    approach: NDArray[np.float64]
    start: NDArray[np.float64]
    angles: NDArray[np.float64]
    verdict: Verdict
    touching: tuple[str, ...]
    tried: int

    def __repr__(self) -> str:
        return (
            f"AutoGrasp({self.posture}, {', '.join(self.touching)} touch, epsilon {self.verdict.epsilon:.3f} N, "
            f"penetration {1e3 * self.penetration:.2f} mm, best of {self.tried})"
        )

    @property
    def score(self) -> float:
        """Score of the verdict [N], larger is better."""
        return self.verdict.score

    @property
    def penetration(self) -> float:
        """Penetration depth of hand and object [m]."""
        return self.verdict.depth

    def poses(self, skeleton: Skeleton) -> Poses:
        """Pose of the closed hand, one frame."""
        return Candidates(self.position[None], self.rotation[None], self.approach[None], self.angles[None]).poses(
            skeleton
        )


def find_grasp(
    covering: Covering,
    thing: GraspObject,
    *,
    closer: Closer | None = None,
    obstacles: Sequence[GraspObject] = (),
    side: str | None = None,
    count: int = 192,
    posture: str | None = None,
    coupling: tuple[float, float] | None = (1.0, 0.7),
    friction: float = 0.6,
    palm: bool = False,
    digits: Sequence[str] = (),
    seed: int = 0,
) -> AutoGrasp:
    """Find a grasp: sample placements of an open hand around the object, close each, judge it, keep the best.

    The open posture is chosen by the object's shape and varied at random; while nothing is found, other postures take
    every second round. Three quarters of the placements put thumb and fingers across a part of the object that fits
    between them, such as a rim, a handle or a narrow side, from directions in which the palm has room
    (``across_widths``, ``free_ways``); the remaining quarter put the palm on the object (``sample_wrists``).

    Placements are processed in rounds of 32. All are closed roughly and ranked by the force closure of contacts within
    2.5 mm. The best six are closed in full, digits stopping at the object, and judged (``Judge``); for those that could
    become the best, digits are then also kept from passing through one another. A grasp that is not force closed, or
    has more than 0.6 mm of penetration, is refused; of the others the one with the best firmness is kept, which counts
    of every contact what closing presses it: a thumb that slides past an object opposes nothing. The search ends after
    a round in which a grasp has a firmness of 0.12 N and uses all digits but one (all digits, for a pinch), or, with
    any grasp, once half of the placements are tried. Fingers that touch nothing are then bent by those beside them.

    Obstacles may be penetrated by 0.1 mm at most: by the open hand on the last 12 cm of its approach, and by the digits
    while they close. Placements that collide are drawn again.

    Args:
        covering: The hand, smooth method.
        thing: The object at its own placement.
        closer: ``Closer`` of this hand and object, to be reused; made if left out.
        obstacles: Other objects at their placements.
        side: ``left`` or ``right``; may be left out for a single hand.
        count: Largest number of placements.
        posture: The only one of ``POSTURES`` that is tried; chosen by the object's shape if left out.
        coupling: See :meth:`~warpjld.grasp.close.Closer.close`.
        friction: Coulomb coefficient.
        digits: Names of the only digits that close, without side: the thumb, and a finger other than the pinky to
            oppose it; by default those of the posture.
        palm: Accept power grips only: the palm and all digits but one are in contact.
        seed: Seed of the random numbers.

    Raises:
        InputError: No hand, no such posture, digits that cannot oppose each other, an object that is nowhere narrow
        enough, or no placement led to a grasp.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> grasp = wj.find_grasp(wj.bind(hand), wj.shapes.ball(0.06), count=32)
        >>> "left.thumb" in grasp.touching, grasp.penetration < 6e-4  # m
        (True, True)
    """
    if count < 1:
        raise InputError(f"count: want 1 or more, got {count}")
    check_friction(friction)
    side = hand_side(covering, side)
    check_opposing(digits)
    first = posture or posture_for(thing.size)
    others = [kind for kind in _OTHERS if kind != first]
    kinds = [first] if posture else [kind for other in others for kind in (first, other)]
    closer = closer or Closer(covering, thing)
    around, rng = Obstacles(covering, obstacles), np.random.default_rng(seed)
    judge = Judge(closer.both, side, friction)
    draws = {
        kind: Draws(covering, closer.both.near, around, side, kind, rng, digits=tuple(digits))
        for kind in dict.fromkeys(kinds)
    }
    refuse_what_is_too_wide(draws[first], friction)
    best: AutoGrasp | None = None
    tried = 0
    for number in range(-(-count // _ROUND)):
        kind = best.posture if best else kinds[number % len(kinds)]
        closing = [f"{side}.{digit}" for digit in draws[kind].closing]
        how = {"digits": closing, "coupling": coupling}
        hands = draws[kind].draw(min(_ROUND, count - number * _ROUND))
        tried += len(hands)
        finalists = _promising(judge, closer, side, hands, around, how)
        for hand, closed, verdict in _best_first(judge, closer, finalists, how):
            least = best.verdict.firmness if best else 0.0
            if verdict.firmness <= least:
                break
            if palm and not _power(verdict, closing):
                continue
            # digits that cross one another are separated last, because this is expensive
            there = closer.parted(hand.poses(covering.skeleton), hand.angles, closed)
            (verdict,) = _verdicts(judge, covering, hand, there)
            if verdict.depth > _DEEPEST or verdict.firmness <= least or (palm and not _power(verdict, closing)):
                continue
            if around and _runs_into(covering, hand, there.angles, around):
                continue
            touching = tuple(name for name in closing if name.removeprefix(f"{side}.") in verdict.digits)
            best = AutoGrasp(
                kind,
                hand.position[0],
                hand.rotation[0],
                hand.approach[0],
                hand.angles[0],
                there.angles[0],
                verdict,
                touching,
                tried,
            )
        good = best and best.verdict.firmness >= _GOOD and len(best.touching) >= len(closing) - (len(closing) > 3)
        if good or (best and 2 * tried >= count):
            break
    if best is None:
        taken = dict.fromkeys(kinds[: -(-count // _ROUND)])
        raise InputError(_no_grasp(thing, draws, first, taken, around, tried, friction, palm))
    return replace(_at_ease(judge, closer, best, draws[best.posture].closing, side, around), tried=tried)


def _at_ease(
    judge: Judge, closer: Closer, best: AutoGrasp, closing: Sequence[str], side: str, around: Obstacles
) -> AutoGrasp:
    """The grasp with fingers that touch nothing bent by those beside them, if it holds as well."""
    covering = closer.covering
    chains = {name: joints for name, joints in digit_chains(covering.skeleton).items() if name.startswith(f"{side}.")}
    taking, touching = [f"{side}.{digit}" for digit in closing], {name.partition(".")[2] for name in best.touching}
    hand = Candidates(best.position[None], best.rotation[None], best.approach[None], best.start[None])
    most = covering.skeleton.limits[:, FLEXION, 1]
    for share in _FOLLOWS:
        angles = idle_fingers_relaxed(best.angles, chains, best.touching, taking, share)
        angles[:, FLEXION] = np.minimum(angles[:, FLEXION], np.maximum(most, best.angles[:, FLEXION]))
        if (angles == best.angles).all():
            break
        there = closer.parted_at(hand.poses(covering.skeleton), hand.angles, angles[None], tuple(chains))
        (verdict,) = _verdicts(judge, covering, hand, there)
        holds = touching <= set(verdict.digits) and verdict.firmness >= _AS_WELL * best.verdict.firmness
        clear = verdict.depth <= _DEEPEST and not (around and _runs_into(covering, hand, there.angles, around))
        if holds and clear:
            return replace(best, angles=there.angles[0], verdict=verdict)
    return best


def _no_grasp(
    thing: GraspObject,
    draws: dict[str, Draws],
    first: str,
    taken: Iterable[str],
    around: Obstacles,
    tried: int,
    friction: float,
    palm: bool,
) -> str:
    """Message that no placement led to a grasp, with the likely cause."""
    turned_down = sum(one.turned_down for one in draws.values())
    blocked = f", or out of reach: {', '.join(around.names)} blocked {turned_down} more" if around else ""
    with_palm = ", palm and digits on it" if palm else ""
    return (
        f"object {thing.name}: none of {tried} placements ends in a grasp that holds at friction {friction:g} "
        f"(postures {', '.join(taken)}){with_palm}: {fault_of(draws[first], friction)}{blocked}"
    )


def check_opposing(digits: Sequence[str]) -> None:
    """Check digits that are to close alone.

    Raises:
        InputError: The thumb has no finger to oppose, or the other way round.
    """
    if digits and not ("thumb" in digits and set(digits) & {"index", "middle", "ring"}):
        raise InputError(
            f"digits: want thumb and one or more of index, middle, ring to oppose it, got {' '.join(digits)}"
        )


def _power(verdict: Verdict, digits: Sequence[str]) -> bool:
    """Whether a grasp by these digits is a power grip."""
    return verdict.palm and len(verdict.digits) >= len(digits) - 1


def _best_first(
    judge: Judge, closer: Closer, hands: Candidates, how: dict[str, Any]
) -> list[tuple[Candidates, Closed, Verdict]]:
    """Close and judge hands, digits not yet separated; best score first, without those that penetrate too deep."""
    if not len(hands):
        return []
    closed = closer.close(hands.poses(closer.covering.skeleton), hands.angles, apart=False, **how)
    verdicts = _verdicts(judge, closer.covering, hands, closed)
    order = np.argsort([-verdict.firmness for verdict in verdicts], kind="stable")
    rows = [int(g) for g in order if verdicts[g].depth <= _DEEPEST]
    return [(hands[g : g + 1], closed[g : g + 1], verdicts[g]) for g in rows]


def _verdicts(judge: Judge, covering: Covering, hands: Candidates, closed: Closed) -> list[Verdict]:
    poses, angles = hands.poses(covering.skeleton, closed.angles), closed.angles.copy()
    for joints in digit_chains(covering.skeleton, closed.digits).values():
        angles[:, list(joints), FLEXION] += _LITTLE
    further = hands.poses(covering.skeleton, angles)
    return judge.judge(poses, covering.deform(poses, threads=1), closed.penetration, further)


def _promising(
    judge: Judge,
    closer: Closer,
    side: str,
    hands: Candidates,
    obstacles: Obstacles,
    how: dict[str, Any],
) -> Candidates:
    """Open hands that rank best after a rough closing, best first, moved back where they would penetrate the object."""
    if not len(hands):
        return hands
    covering = closer.covering
    quick = closer.close(hands.poses(covering.skeleton), hands.angles, quick=True, **how)
    poses = hands.poses(covering.skeleton, quick.angles)
    skins = covering.deform(poses, threads=1)
    ranks = np.where(obstacles.missed(skins), judge.first_look(poses, skins), 0.0)
    best = np.argsort(-ranks, kind="stable")[:_FINALISTS]
    best = best[ranks[best] > 0.0]
    return _clear_of(closer, side, hands[best], quick.angles[best])


def _runs_into(covering: Covering, hand: Candidates, closed: NDArray[np.float64], obstacles: Obstacles) -> bool:
    """Whether a hand enters an obstacle while its digits close."""
    angles = hand.angles + np.array(_CLOSES)[:, None, None] * (closed - hand.angles)
    skins = covering.deform(hand[np.zeros(len(angles), dtype=int)].poses(covering.skeleton, angles))
    return obstacles.depth(skins) > COLLIDES


def _clear_of(closer: Closer, side: str, hands: Candidates, closed: NDArray[np.float64]) -> Candidates:
    """Move open hands back until neither they nor the palm, which swells as digits close, penetrate the object."""
    covering, both = closer.covering, closer.both
    palm = both.parts.index(f"{side}.palm")
    going, back = np.arange(len(hands)), np.zeros(len(hands))
    for _ in range(4):
        if not len(going):
            break
        withdrawn = hands[going].moved(-back[going])
        opened, swollen = (
            both.depths(covering.deform(withdrawn.poses(covering.skeleton, angles), threads=1))
            for angles in (None, closed[going])
        )
        depth = np.maximum(opened.max(axis=1), swollen[:, palm])
        back[going] += np.where(depth < _PRESSED, 0.0, 1.2 * depth)
        going = going[depth >= _PRESSED]
    return hands.moved(-back)
