"""Grasping by itself: placements around an object, a posture for its shape, the best of the hands that close
(A §10, R90)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.close import Closed, close_hand
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.judge import Judge, Verdict
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.opening import Opening, closing_in_air
from warpjld.grasp.placements import Candidates, across_widths, sample_wrists
from warpjld.grasp.postures import AHEAD, CLOSING, posture_angles, posture_for
from warpjld.grasp.widths import Widths, sample_widths
from warpjld.skeleton import CHANNELS, DIGITS, Poses, Skeleton

__all__ = ["AutoGrasp", "find_grasp"]

_LINES = 400  # through the object, to find where it is narrow
_PALM_FIRST = 0.25  # share of the placements that are made palm first
_VARIANTS = 6  # of a posture
_ROUND = 32  # placements looked at together
_FINALISTS = 6  # of a round, closed and judged in full
_DEEPEST = 1e-3  # of hand and object in one another, above which a grasp is refused [m]
_PRESSED = 3e-4  # depth from which an open hand goes back [m]
_GOOD = 0.12  # score that ends the search early [N]


@dataclass(frozen=True, eq=False)
class AutoGrasp:
    """The best grasp found.

    Attributes:
        posture: Name of the posture it began with.
        position: Displacement of the skeleton's root [m], shape (3,).
        rotation: Rotation of the root about its rest place, x y z w, shape (4,).
        approach: Direction in which the hand came, shape (3,).
        start: Angles of the open hand [rad], shape (J, 4).
        angles: Angles of the closed hand [rad], shape (J, 4).
        verdict: What it was chosen by.
        touching: Digits that touch.
        tried: Placements that were closed.
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

    @property
    def score(self) -> float:
        """That of the verdict."""
        return self.verdict.score

    @property
    def penetration(self) -> float:
        """Depth of hand and object in one another [m]."""
        return self.verdict.depth

    def poses(self, skeleton: Skeleton) -> Poses:
        """The closed hand, one frame."""
        return Candidates(self.position[None], self.rotation[None], self.approach[None], self.angles[None]).poses(
            skeleton
        )


def find_grasp(
    covering: Covering,
    thing: GraspObject,
    *,
    side: str | None = None,
    count: int = 96,
    posture: str | None = None,
    coupling: tuple[float, float] | None = (1.0, 0.7),
    friction: float = 0.6,
    seed: int = 0,
) -> AutoGrasp:
    """Place open hands about the object, close them, judge them, keep the best.

    A posture is chosen by the object's shape, and varied. Three quarters of the placements put thumb and fingers across
    a part of the object that fits between them (``across_widths``), the others the palm on it (``sample_wrists``).
    They are taken in rounds of 32: all are closed roughly and ranked by the force closure of what nearly touches; the
    best six are closed in full, without digits that pass through the object or one another, and judged (``Judge``). A
    grasp that is not force closed, or in which hand and object are more than 1 mm in one another, is refused; of the
    others the best score is kept. One with a score of 0.12 N and all digits but one (of a pinch all) ends the search.

    Args:
        covering: The hand.
        thing: The object where it stands.
        side: ``left`` or ``right``; may be left out for a single hand.
        count: Placements at most.
        posture: One of ``POSTURES``; by the object's shape if left out.
        coupling: See :func:`~warpjld.grasp.close.close_hand`.
        friction: Coulomb coefficient.
        seed: Of the sampling.

    Raises:
        InputError: No hand, no such posture, or no placement ends in a grasp.
    """
    if count < 1:
        raise InputError(f"count: want 1 or more, got {count}")
    if not (np.isfinite(friction) and friction > 0.0):
        raise InputError(f"friction: want a number above 0, got {friction:g}")
    sides = [s for s in ("left", "right") if f"{s}.middle.base" in covering.skeleton.names]
    side = side or (sides[0] if len(sides) == 1 else "")
    if side not in sides:
        raise InputError(f"side: want one of {', '.join(sides) or 'a hand'}, got '{side}'")
    chosen = posture or posture_for(thing.size)
    start = posture_angles(covering.skeleton, side, chosen)
    closing = [digit for digit in CLOSING.get(chosen, DIGITS) if f"{side}.{digit}" in digit_chains(covering.skeleton)]
    digits = [f"{side}.{digit}" for digit in closing]
    objects, rng = ObjectSet(thing), np.random.default_rng(seed)
    judge = Judge(covering, thing, side, friction)
    best: AutoGrasp | None = None
    for first in range(0, count, _ROUND):
        hands = _placements(covering, objects, side, chosen, start, closing, min(_ROUND, count - first), rng)
        for hand in _promising(judge, side, hands, objects, digits, coupling):
            found = _closed(judge, hand, objects, digits, coupling, best.score if best else 0.0)
            if found is None:
                continue
            closed, verdict = found
            touching = tuple(name for name in digits if name.removeprefix(f"{side}.") in verdict.digits)
            best = AutoGrasp(
                chosen,
                hand.position[0],
                hand.rotation[0],
                hand.approach[0],
                hand.angles[0],
                closed.angles[0],
                verdict,
                touching,
                first + len(hands),
            )
            if verdict.score >= _GOOD and len(touching) >= len(digits) - (len(digits) > 3):
                return best
    if best is None:
        raise InputError(
            f"object {thing.name}: none of {count} placements ends in a grasp; it may be too large, too small or thin"
        )
    return replace(best, tried=count)


def _promising(
    judge: Judge,
    side: str,
    hands: Candidates,
    objects: ObjectSet,
    digits: list[str],
    coupling: tuple[float, float] | None,
) -> Iterator[Candidates]:
    """Open hands that do best when closed roughly, best first, moved out of what they would press into."""
    covering = judge.covering
    open_hands = hands.poses(covering.skeleton)
    quick = close_hand(covering, open_hands, hands.angles, objects, digits=digits, coupling=coupling, quick=True)
    poses = hands.poses(covering.skeleton, quick.angles)
    ranks = judge.first_look(poses, covering.deform(poses))
    for row in np.argsort(-ranks, kind="stable")[:_FINALISTS].tolist():
        if ranks[row] > 0.0:
            one = slice(row, row + 1)
            yield _clear_of(judge, side, hands[one], quick.angles[one])


def _closed(
    judge: Judge,
    hand: Candidates,
    objects: ObjectSet,
    digits: list[str],
    coupling: tuple[float, float] | None,
    least: float,
) -> tuple[Closed, Verdict] | None:
    """Close a hand; None where it scores no more than ``least``. Whether digits cross is looked at last: it costs."""
    covering, verdict = judge.covering, None
    for apart in (False, True):
        closed = close_hand(
            covering,
            hand.poses(covering.skeleton),
            hand.angles,
            objects,
            digits=digits,
            coupling=coupling,
            apart=apart,
        )
        there = hand.poses(covering.skeleton, closed.angles)
        verdict = judge.judge(there, covering.deform(there)[0])
        if verdict.depth > _DEEPEST or verdict.score <= least:
            return None
    assert verdict is not None
    return closed, verdict


def _placements(
    covering: Covering,
    objects: ObjectSet,
    side: str,
    posture: str,
    start: NDArray[np.float64],
    closing: list[str],
    count: int,
    rng: np.random.Generator,
) -> Candidates:
    """Placements of both kinds, ``count`` in all."""
    (thing,) = objects.objects
    openings = _variants(covering, side, start, closing, rng)
    most = max(one.width[0] for one in openings)
    widths = sample_widths(objects, _LINES, rng, widest=float(most))
    across = count - int(_PALM_FIRST * count) if len(widths) else 0
    some = []
    if across:
        chosen = rng.choice(len(widths), size=across, p=_preference(widths, thing))
        turned = rng.random(across) < 0.5
        picked = widths[chosen]
        ends = (
            np.where(turned[:, None], picked.second, picked.first),
            np.where(turned[:, None], picked.first, picked.second),
        )
        into = 0.3 if posture == "pinch" else 1.0
        some.append(across_widths(covering, openings, objects, Widths(*ends, picked.slant), side, rng, into=into))
    if count > across:
        ahead = AHEAD.get(posture, 0.0)
        some.append(sample_wrists(covering, start, thing, side, count - across, rng, ahead=ahead))
    return Candidates.joined(some)


def _variants(
    covering: Covering, side: str, start: NDArray[np.float64], closing: list[str], rng: np.random.Generator
) -> list[Opening]:
    """A posture as it is, and with thumb and fingers a little elsewhere."""
    skeleton, found = covering.skeleton, []
    for variant in range(_VARIANTS):
        angles = start.copy()
        if variant:
            bend = rng.uniform(0.0, 20.0)
            shifts = {"thumb.base": {"pivot": rng.uniform(-15, 10), "abduction": rng.uniform(-20, 15)}}
            shifts |= {f"{digit}.base": {"flexion": bend} for digit in closing if digit != "thumb"}
            for name, channels in shifts.items():
                row = skeleton.index(f"{side}.{name}")
                for channel, degrees in channels.items():
                    column = CHANNELS.index(channel)
                    turned = angles[row, column] + np.radians(degrees)
                    angles[row, column] = np.clip(turned, *skeleton.limits[row, column])
        found.append(closing_in_air(covering, side, angles, closing))
    return found


def _preference(widths: Widths, thing: GraspObject) -> NDArray[np.float64]:
    """How likely a width is taken: straight through, and near the centre of mass."""
    centre = thing.place.apply(thing.centroid[None])[0, 0]
    off = np.linalg.norm(0.5 * (widths.first + widths.second) - centre, axis=1)
    radius = np.linalg.norm(thing.vertices - thing.centroid, axis=1).max()
    weight = widths.slant**4 * np.exp(-((off / (0.4 * radius)) ** 2)) + 1e-6
    return np.asarray(weight / weight.sum())


def _clear_of(judge: Judge, side: str, hand: Candidates, closed: NDArray[np.float64]) -> Candidates:
    """One open hand, moved back while the object presses into it, or will into the palm that swells as it closes."""
    skeleton, both = judge.covering.skeleton, judge.both
    palm = both.parts.index(f"{side}.palm")
    for _ in range(4):
        opened = judge.covering.deform(hand.poses(skeleton))[0]
        swollen = judge.covering.deform(hand.poses(skeleton, closed))[0]
        depth = max(both.depths(opened).max(), both.depths(swollen)[palm])
        if depth < _PRESSED:
            break
        hand = hand.moved(np.array([-1.2 * depth]))
    return hand
