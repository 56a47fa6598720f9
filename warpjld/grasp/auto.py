"""Grasping by itself: placements around an object, a posture for its shape, the best of the hands that close
(A §10, R90)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.close import Closed, close_hand
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.draws import Draws
from warpjld.grasp.judge import Judge, Verdict
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.obstacles import COLLIDES, Obstacles
from warpjld.grasp.placements import Candidates
from warpjld.grasp.postures import CLOSING, posture_angles, posture_for
from warpjld.skeleton import DIGITS, Poses, Skeleton

__all__ = ["AutoGrasp", "find_grasp"]

_ROUND = 32  # placements looked at together
_FINALISTS = 6  # of a round, closed and judged in full
_DEEPEST = 1e-3  # of hand and object in one another, above which a grasp is refused [m]
_PRESSED = 3e-4  # depth from which an open hand goes back [m]
_GOOD = 0.12  # score that ends the search early [N]
_CLOSES = (0.0, 0.25, 0.5, 0.75, 1.0)  # parts of the digits' way at which the hand must not be in an obstacle


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
    obstacles: Sequence[GraspObject] = (),
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

    Obstacles are stayed clear of by 0.1 mm of depth: by the open hand on the last 12 cm of its way, and by its digits
    while they close. Placements that they are in the way of are drawn again.

    Args:
        covering: The hand.
        thing: The object where it stands.
        obstacles: Other objects where they stand.
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
    objects, around = ObjectSet(thing), Obstacles(covering, obstacles)
    judge = Judge(covering, thing, side, friction)
    draws = Draws(covering, objects, around, side, chosen, start, closing, np.random.default_rng(seed))
    best: AutoGrasp | None = None
    tried = 0
    for first in range(0, count, _ROUND):
        hands = draws.draw(min(_ROUND, count - first))
        tried += len(hands)
        for hand in _promising(judge, side, hands, objects, around, digits, coupling):
            found = _closed(judge, hand, objects, around, digits, coupling, best.score if best else 0.0)
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
                tried,
            )
            if verdict.score >= _GOOD and len(touching) >= len(digits) - (len(digits) > 3):
                return best
    if best is None:
        blocked = f", or out of reach: {', '.join(around.names)} blocked {draws.turned_down} more" if around else ""
        raise InputError(
            f"object {thing.name}: none of {tried} placements ends in a grasp; it may be too large, too small or thin"
            f"{blocked}"
        )
    return replace(best, tried=tried)


def _promising(
    judge: Judge,
    side: str,
    hands: Candidates,
    objects: ObjectSet,
    obstacles: Obstacles,
    digits: list[str],
    coupling: tuple[float, float] | None,
) -> Iterator[Candidates]:
    """Open hands that do best when closed roughly, best first, moved out of what they would press into."""
    if not len(hands):
        return
    covering = judge.covering
    open_hands = hands.poses(covering.skeleton)
    quick = close_hand(covering, open_hands, hands.angles, objects, digits=digits, coupling=coupling, quick=True)
    poses = hands.poses(covering.skeleton, quick.angles)
    skins = covering.deform(poses)
    ranks = np.where(obstacles.missed(skins), judge.first_look(poses, skins), 0.0)
    for row in np.argsort(-ranks, kind="stable")[:_FINALISTS].tolist():
        if ranks[row] > 0.0:
            one = slice(row, row + 1)
            yield _clear_of(judge, side, hands[one], quick.angles[one])


def _closed(
    judge: Judge,
    hand: Candidates,
    objects: ObjectSet,
    obstacles: Obstacles,
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
    if obstacles and _runs_into(covering, hand, closed.angles, obstacles):
        return None
    assert verdict is not None
    return closed, verdict


def _runs_into(covering: Covering, hand: Candidates, closed: NDArray[np.float64], obstacles: Obstacles) -> bool:
    """Whether a hand enters an obstacle while its digits close."""
    angles = hand.angles + np.array(_CLOSES)[:, None, None] * (closed - hand.angles)
    skins = covering.deform(hand[np.zeros(len(angles), dtype=int)].poses(covering.skeleton, angles))
    return any(obstacles.depth(skin) > COLLIDES for skin in skins)


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
