"""Grasping by itself: wrist placements around an object, a posture for its shape, the best of the hands that close
(A §10, R90)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.close import Closed, close_hand, digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.postures import AHEAD, CLOSING, posture_angles, posture_for
from warpjld.skeleton import DIGITS, Poses, Skeleton, poses_from_angles

__all__ = ["AutoGrasp", "Candidates", "find_grasp", "palm_frame", "sample_wrists"]

_CLEARANCE = 3e-4  # between the open hand and the object [m]
_TOUCH = 5e-4  # skin this near counts as a contact in the score [m]
_FINALISTS = 8  # placements in which digits are kept from crossing one another
_HOLDS = 0.5  # score below which digits push one way rather than against one another
_DEEPEST = 1e-3  # penetration above which a grasp is refused [m]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Placements of an open hand.

    Attributes:
        position: Displacement of the skeleton's root [m], shape (G, 3).
        rotation: Rotation of the root about its rest place, x y z w, shape (G, 4).
        approach: Where the palm looks, shape (G, 3).
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    approach: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True, eq=False)
class AutoGrasp:
    """The best grasp found.

    Attributes:
        posture: Name of the posture it began with.
        position: Displacement of the skeleton's root [m], shape (3,).
        rotation: Rotation of the root about its rest place, shape (4,).
        approach: Where the palm looks, shape (3,).
        start: Angles of the open hand [rad], shape (J, 4).
        angles: Angles of the closed hand [rad], shape (J, 4).
        score: Larger is better; see :func:`find_grasp`.
        touching: Digits that touch.
        penetration: Deepest vertex of the whole hand inside the object [m].
        tried: Placements that were closed.
    """

    posture: str
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    approach: NDArray[np.float64]
    start: NDArray[np.float64]
    angles: NDArray[np.float64]
    score: float
    touching: tuple[str, ...]
    penetration: float
    tried: int

    def poses(self, skeleton: Skeleton) -> Poses:
        """The closed hand, one frame."""
        return poses_from_angles(
            skeleton, self.angles[None], root_position=self.position[None], root_rotation=self.rotation[None]
        )


def palm_frame(skeleton: Skeleton, side: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middle of the palm at rest [m], shape (3,), and rows: where it looks, where the fingers point, their cross
    product, shape (3, 3)."""
    knuckle = skeleton.index(f"{side}.middle.base")
    wrist = skeleton.index(f"{side}.wrist")
    fingers = skeleton.rest[knuckle] - skeleton.rest[wrist]
    fingers = fingers / np.linalg.norm(fingers)
    look = -np.cross(skeleton.directions[knuckle], skeleton.axes[knuckle])
    look = look - fingers * (look @ fingers)
    look /= np.linalg.norm(look)
    middle = 0.75 * skeleton.rest[knuckle] + 0.25 * skeleton.rest[wrist]
    return middle, np.stack([look, fingers, np.cross(look, fingers)])


def sample_wrists(
    covering: Covering,
    angles: NDArray[np.float64],
    thing: GraspObject,
    side: str,
    count: int,
    rng: np.random.Generator,
    *,
    ahead: float = 0.0,
) -> Candidates:
    """Placements of an open hand with its palm on the object.

    The palm looks against a direction out of the object's centre, evenly spread over the sphere; the fingers point
    anywhere about it; the palm's middle is aimed at the centre, off by up to a fifth of the object's size. The hand
    then comes as near as it can without touching: its skin's distance bounds each step. With ``ahead`` [m] the object
    is met up to that far before the palm's middle towards the fingers, and the palm stays as far away from it.
    """
    middle, frame = palm_frame(covering.skeleton, side)
    part = rng.uniform(0.0, 1.0, size=(count, 1)) if ahead else np.zeros((count, 1))
    middle = middle + ahead * part * frame[1]
    golden = np.pi * (3.0 - 5.0**0.5)
    k = np.arange(count) + 0.5
    high = 1.0 - 2.0 * k / count
    out = np.stack([np.sqrt(1 - high**2) * np.cos(golden * k), high, np.sqrt(1 - high**2) * np.sin(golden * k)], axis=1)
    look = -(Rotation.random(rng=rng).apply(out))
    any_side = np.cross(look, np.eye(3)[np.abs(look).argmin(axis=1)])
    any_side /= np.linalg.norm(any_side, axis=1, keepdims=True)
    roll = rng.uniform(0.0, 2.0 * np.pi, size=(count, 1))
    fingers = np.cos(roll) * any_side + np.sin(roll) * np.cross(look, any_side)
    target = np.stack([look, fingers, np.cross(look, fingers)], axis=1)
    turn = np.einsum("gki,kj->gij", target, frame)
    rotation = Rotation.from_matrix(turn)
    root = covering.skeleton.rest[0]
    centre = thing.place.apply(thing.centroid[None])[0, 0]
    reach = float(np.linalg.norm(thing.size)) + 0.1
    aim = centre + rng.uniform(-0.2, 0.2, size=(count, 3)) * thing.size
    position = aim - look * reach - (root + rotation.apply(middle - root))
    return Candidates(
        -look * ahead * part + _approach(covering, angles, thing, position, rotation.as_quat(), look, 2 * reach),
        rotation.as_quat(),
        look,
    )


def _approach(
    covering: Covering,
    angles: NDArray[np.float64],
    thing: GraspObject,
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    look: NDArray[np.float64],
    reach: float,
) -> NDArray[np.float64]:
    """Move hands along where the palm looks until their skin is next to the object."""
    count = len(position)
    poses = poses_from_angles(
        covering.skeleton, np.repeat(angles[None], count, axis=0), root_position=position, root_rotation=rotation
    )
    skin = covering.deform(poses)
    objects, moved = ObjectSet(thing), np.zeros(count)
    for _ in range(24):
        shifted = skin + (look * moved[:, None])[:, None].astype(np.float32)
        gap = objects.distances(shifted, which=np.zeros(count, int)).distance.min(axis=1)
        step = np.where(moved < reach, np.maximum(gap - _CLEARANCE, 0.0), 0.0)
        if (step < 1e-5).all():
            break
        moved += step
    return position + look * moved[:, None]


def find_grasp(
    covering: Covering,
    thing: GraspObject,
    *,
    side: str | None = None,
    count: int = 64,
    posture: str | None = None,
    coupling: tuple[float, float] | None = (1.0, 0.7),
    seed: int = 0,
    score: Callable[[Covering, GraspObject, Candidates, Closed], NDArray[np.float64]] | None = None,
) -> AutoGrasp:
    """Sample placements, choose a posture by the object's shape, close, score, keep the best.

    The default score of a hand is Σ over digits 1 − |Σ n̄_d| / D, the number of touching digits times how well their
    mean contact normals n̄_d (of the object, outward, unit) cancel: 0 where all push one way; ½ is wanted. Grasps
    without thumb, with one digit, or deeper inside than 1 mm score −1. Crossing digits are looked for in the best
    eight only; the first of them that keeps its thumb and two more digits (of a pinch one more) on the object is taken.

    Args:
        covering: The hand.
        thing: The object where it stands.
        side: ``left`` or ``right``; may be left out for a single hand.
        count: Placements.
        posture: One of ``POSTURES``; by the object's shape if left out.
        coupling: See :func:`~warpjld.grasp.close.close_hand`.
        seed: Of the sampling.
        score: Another score of G closed hands, shape (G,).

    Raises:
        InputError: No hand, no such posture, or no placement ends in a grasp.
    """
    if count < 1:
        raise InputError(f"count: want 1 or more, got {count}")
    sides = [s for s in ("left", "right") if f"{s}.middle.base" in covering.skeleton.names]
    side = side or (sides[0] if len(sides) == 1 else "")
    if side not in sides:
        raise InputError(f"side: want one of {', '.join(sides) or 'a hand'}, got '{side}'")
    chosen = posture or posture_for(thing.size)
    start = posture_angles(covering.skeleton, side, chosen)
    rng = np.random.default_rng(seed)
    candidates = sample_wrists(covering, start, thing, side, count, rng, ahead=AHEAD.get(chosen, 0.0))
    many = np.repeat(start[None], count, axis=0)
    poses = poses_from_angles(
        covering.skeleton, many, root_position=candidates.position, root_rotation=candidates.rotation
    )
    closing = CLOSING.get(chosen, DIGITS)
    digits = [f"{side}.{name}" for name in closing if f"{side}.{name}" in digit_chains(covering.skeleton)]
    objects = ObjectSet(thing)
    closed = close_hand(covering, poses, many, objects, digits=digits, coupling=coupling, apart=False)
    points = (score or _balance)(covering, thing, candidates, closed)
    found = None
    for best in [int(k) for k in np.argsort(-points, kind="stable")[:_FINALISTS] if points[k] > _HOLDS]:
        one = slice(best, best + 1)
        again = close_hand(covering, poses[one], many[one], objects, digits=digits, coupling=coupling)
        touching = tuple(name for name, touch in zip(again.digits, again.touching()[0], strict=True) if touch)
        opposed = len(touching) > 1 and touching[-1].endswith("thumb")
        if again.penetration[0] > _DEEPEST or not touching:
            continue
        grasp = AutoGrasp(
            chosen,
            candidates.position[best],
            candidates.rotation[best],
            candidates.approach[best],
            start,
            again.angles[0],
            float(points[best]),
            touching,
            float(again.penetration[0]),
            count,
        )
        if opposed and len(touching) >= min(3, len(digits) - 1):
            return grasp
        found = found or (grasp if opposed else None)
    if found is None:
        raise InputError(
            f"object {thing.name}: none of {count} placements ends in a grasp; it may be too large, too small or thin"
        )
    return found


def _balance(covering: Covering, thing: GraspObject, candidates: Candidates, closed: Closed) -> NDArray[np.float64]:
    from warpjld.grasp.close import _moved

    poses = poses_from_angles(
        covering.skeleton, closed.angles, root_position=candidates.position, root_rotation=candidates.rotation
    )
    objects = ObjectSet(thing)
    normals = Rotation.from_quat(thing.place.rotation[0]).apply(thing.normals)
    chains = digit_chains(covering.skeleton, closed.digits)
    total, touching = np.zeros((len(poses), 3)), np.zeros((len(poses), len(chains)), dtype=bool)
    for d, chain in enumerate(chains.values()):
        skin = covering.points(poses, _moved(covering, chain[0]))
        found = objects.distances(skin, which=np.zeros(len(poses), int), limit=0.01)
        near = np.abs(found.distance) < _TOUCH
        touching[:, d] = near.any(axis=1)
        mean = np.einsum("gn,gni->gi", near, normals[found.face])
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        total += np.where(length > 1e-9, mean / np.maximum(length, 1e-9), 0.0)
    count = touching.sum(axis=1)
    thumb = touching[:, [name.endswith("thumb") for name in chains]].any(axis=1)
    points = count * (1.0 - np.linalg.norm(total, axis=1) / np.maximum(count, 1))
    return np.where(thumb & (count >= 2) & (closed.penetration < _DEEPEST), points, -1.0)
