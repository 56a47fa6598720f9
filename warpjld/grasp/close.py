"""Closing a hand: digits bend joint by joint until their skin touches the object (A §7, R76; R90)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.objects import Places
from warpjld.grasp.search import FlexionSearch, Searches, Status
from warpjld.grasp.separate import keep_apart
from warpjld.skeleton import CHANNELS, DIGITS, Poses, Skeleton, poses_from_angles

__all__ = ["Closed", "close_hand", "digit_chains", "pad_vertex"]

_FLEXION = CHANNELS.index("flexion")
_KNUCKLES = ("base", "knuckle2", "knuckle3")
_OWN = 0.5  # share of the operators at or beyond a joint from which a vertex counts as moved by it
_WIDEST = 0.35  # how far a base joint may open again for the sake of swelling skin [rad]
_HALVINGS = 10


@dataclass(frozen=True, eq=False)
class Closed:
    """Hands closed from G postures.

    Attributes:
        angles: Joint angles [rad], shape (G, J, 4).
        digits: Names of the digits that closed, e.g. ``left.index``.
        status: Per digit and joint how its search ended (values of ``Status``), shape (G, D, 3); CONVERGED is a touch,
            NO_CONTACT the limit reached without one.
        penetration: Deepest vertex of the digits inside the object [m], shape (G,).
    """

    angles: NDArray[np.float64]
    digits: tuple[str, ...]
    status: NDArray[np.int32]
    penetration: NDArray[np.float64]

    def touching(self) -> NDArray[np.bool_]:
        """Digits stopped by a touch at some joint, shape (G, D)."""
        return np.asarray((self.status == Status.CONVERGED).any(axis=2))


def digit_chains(skeleton: Skeleton, digits: Sequence[str] = ()) -> dict[str, tuple[int, ...]]:
    """Flexion joints of the digits of a skeleton, base first; of all, or of those named (``index``, ``left.index``).

    Raises:
        InputError: There is no such digit, or none at all.
    """
    found = {}
    for side in ("left.", "right.", ""):
        for digit in DIGITS:
            names = [f"{side}{digit}.{k}" for k in _KNUCKLES]
            if all(name in skeleton.names for name in names):
                found[f"{side}{digit}"] = tuple(skeleton.names.index(name) for name in names)
    if not found:
        raise InputError("this skeleton has no digits to close")
    if not digits:
        return found
    chosen = {}
    for digit in digits:
        matches = [name for name in found if digit.lower() in (name, name.partition(".")[2])]
        if len(matches) != 1:
            raise InputError(f"no digit '{digit}' in this skeleton; there are {', '.join(found)}")
        chosen[matches[0]] = found[matches[0]]
    return chosen


@lru_cache(maxsize=32)
def _moved(covering: Covering, joint: int) -> NDArray[np.int32]:
    """Vertices of which operators at or beyond a joint hold at least half."""
    skeleton, anchors = covering.skeleton, covering.anchors
    beyond = np.zeros(len(skeleton), dtype=bool)
    for j in range(len(skeleton)):
        beyond[j] = j == joint or (skeleton.parents[j] >= 0 and beyond[skeleton.parents[j]])
    share = (anchors.weight * beyond[anchors.ends[anchors.segment, 0]]).sum(axis=1)
    return np.flatnonzero(share >= _OWN).astype(np.int32)


def pad_vertex(covering: Covering, digit: str) -> int:
    """The vertex in the middle of a digit's pad: on the internal side of its last segment, three fifths along.

    Raises:
        InputError: There is no such digit.
    """
    (chain,) = digit_chains(covering.skeleton, [digit]).values()
    anchors = covering.anchors
    strongest = anchors.weight.argmax(axis=1)
    rows = np.arange(len(anchors))
    on_last = anchors.ends[anchors.segment[rows, strongest], 0] == chain[-1]
    ratio, side = anchors.ratio[rows, strongest], anchors.side[rows, strongest]
    # of vertices alike in ratio the one farthest out on the internal side
    height = np.linalg.norm(anchors.lift[rows, strongest], axis=1)
    length = np.linalg.norm(np.ptp(covering.surface.vertices[on_last], axis=0))
    cost = np.where(on_last, np.abs(ratio - 0.6) + side - height / length, np.inf)
    return int(cost.argmin())


def close_hand(
    covering: Covering,
    poses: Poses,
    angles: NDArray[np.float64],
    objects: ObjectSet,
    *,
    which: NDArray[np.int32] | int = 0,
    places: Places | None = None,
    digits: Sequence[str] = (),
    coupling: tuple[float, float] | None = None,
    apart: bool = True,
    tolerance: float = 1e-5,
    threads: int | None = None,
) -> Closed:
    """Close the digits of G hands, each on its object, in a few launches.

    Every digit bends at its base until a vertex beyond touches, then at its second joint, then at its third; a joint
    whose skin touches already stays. With ``coupling`` all three bend together until the first touch, the others at
    these times the base's rate; joints beyond the touch then go on together. Skin that swells as a finger bends may
    enter the object beside a touch: the base then opens as far as it must, and the joints beyond close again.

    Args:
        covering: The hand, smooth method.
        poses: G postures to start from, open.
        angles: Their joint angles [rad], shape (G, J, 4).
        objects: Search structures.
        which: Object of every hand.
        places: Place of every hand's object; the objects' own if left out.
        digits: Names of digits; all if left out.
        coupling: Rates of the second and third joint relative to the base.
        apart: Stop digits that would pass through one another or the palm; the costliest part.
        tolerance: Distance that counts as a touch [m].
        threads: CPU threads.

    Raises:
        InputError: No such digit, or postures of another skeleton.
    """
    chains = digit_chains(covering.skeleton, digits)
    count = len(poses)
    which = np.broadcast_to(objects.check(which), count)
    if places is None:
        own = [objects.objects[k].place for k in which]
        places = Places(np.concatenate([p.position for p in own]), np.concatenate([p.rotation for p in own]))
    elif len(places) == 1:
        places = places[np.zeros(count, dtype=int)]
    hand = _Hand(covering, poses, angles, objects, which, places, tolerance, threads)
    names = list(chains)
    status = np.full((count, len(names), 3), int(Status.NO_CONTACT), dtype=np.int32)
    joints = np.array([chains[name] for name in names])
    first = 0
    if coupling is not None:
        _, ended, at = hand.bend(joints, np.array([1.0, *coupling]))
        status[..., 0] = ended
        # the joint whose segment was touched, and those before it, stay
        hand.free = at
    for k in range(first, 3):
        _, ended, _ = hand.bend(joints[:, k:], np.array([1.0, 0.0, 0.0])[: 3 - k], only=k)
        keep = status[..., k] == int(Status.CONVERGED) if coupling is not None else np.zeros_like(ended, dtype=bool)
        status[..., k] = np.where(keep, status[..., k], ended)
    hand.settle(joints)
    if apart:
        for g in range(count):
            hand.angles[g], stopped = keep_apart(covering, partial(hand.poses_of, g), angles[g], hand.angles[g], chains)
            for name in stopped:
                status[g, names.index(name)] = int(Status.BLOCKED)
    return Closed(hand.angles, tuple(names), status, np.maximum(0.0, -hand.gap(joints)).max(axis=1))


class _Hand:
    """Hands on their way; ``angles`` change."""

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        angles: NDArray[np.float64],
        objects: ObjectSet,
        which: NDArray[np.int32],
        places: Places,
        tolerance: float,
        threads: int | None,
    ) -> None:
        covering.check(poses)
        self.covering, self.angles, self.open = covering, angles.copy(), angles
        self.objects, self.which, self.places = objects, which, places
        self.tolerance, self.threads = tolerance, threads
        self.search = FlexionSearch(covering, objects)
        self.free: NDArray[np.int32] | None = None
        rest = poses_from_angles(covering.skeleton, angles)
        turn = Rotation.from_quat(poses.rotations[:, 0]) * Rotation.from_quat(rest.rotations[:, 0]).inv()
        self._turn = turn.as_quat()
        self._shift = poses.positions[:, 0] - covering.skeleton.rest[0]

    def poses(self, angles: NDArray[np.float64] | None = None) -> Poses:
        """Poses of the present, or of other angles."""
        return poses_from_angles(
            self.covering.skeleton,
            self.angles if angles is None else angles,
            root_position=self._shift,
            root_rotation=self._turn,
        )

    def poses_of(self, g: int, angles: NDArray[np.float64]) -> Poses:
        """Poses of one hand with other angles (n, J, 4)."""
        count = len(angles)
        return poses_from_angles(
            self.covering.skeleton,
            angles,
            root_position=np.repeat(self._shift[g : g + 1], count, axis=0),
            root_rotation=np.repeat(self._turn[g : g + 1], count, axis=0),
        )

    def bend(
        self, joints: NDArray[np.int64], rates: NDArray[np.float64], only: int | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
        """Bend the joints of every digit (D, k) together until the first touch.

        Returns:
            Closing (G, D), status (G, D), and which of the joints holds the touch (G, D).
        """
        count = len(self.angles)
        vertices = [_moved(self.covering, int(chain[0])) for chain in joints]
        owner = np.concatenate([np.full(len(v), d) for d, v in enumerate(vertices)])
        vertex = np.concatenate(vertices)
        moving = rates != 0.0
        frame = np.repeat(np.arange(count), len(vertex))
        digit = np.tile(owner, count)
        used = joints[:, moving][digit]
        stop = None
        if self.free is not None and only is not None:
            # after a coupled touch on a joint's segment, that joint and those before it stay where they are
            held = self.free[frame, digit] >= only
            now = self.angles[frame[:, None], used, _FLEXION]
            largest = self.covering.skeleton.limits[used, _FLEXION, 1]
            stop = np.where(held[:, None], now, largest)
        found = self.search.run(
            self.poses(),
            self.angles,
            Searches(
                vertex=np.tile(vertex, count),
                joint=used,
                frame=frame,
                thing=self.which[frame],
                place=frame,
                rate=np.broadcast_to(rates[moving], used.shape),
                stop=stop,
                distance=self.tolerance,
            ),
            places=self.places,
            tolerance=self.tolerance,
            threads=self.threads,
        )
        closing = np.where(found.status == Status.NO_CONTACT, np.inf, found.closing).reshape(count, -1)
        status = found.status.reshape(count, -1)
        closing = np.where(status == Status.AT_LIMIT, np.inf, closing)
        best = np.full((count, len(joints)), np.inf)
        ended = np.empty((count, len(joints)), dtype=np.int32)
        at = np.full((count, len(joints)), -1, dtype=np.int32)
        for d, chain in enumerate(joints):
            own = owner == d
            place = closing[:, own].argmin(axis=1)
            rows = np.arange(count)
            best[:, d] = closing[:, own][rows, place]
            ended[:, d] = np.where(np.isfinite(best[:, d]), status[:, own][rows, place], int(Status.NO_CONTACT))
            touched = vertex[own][place]
            for k, joint in enumerate(chain):
                at[:, d] = np.where(
                    np.isin(touched, _moved(self.covering, int(joint))) & np.isfinite(best[:, d]), k, at[:, d]
                )
            self._go(chain[moving], rates[moving], best[:, d], frozen=self._frozen(d, only))
        return best, ended, at

    def _frozen(self, d: int, only: int | None) -> NDArray[np.bool_]:
        if self.free is None or only is None:
            return np.zeros(len(self.angles), dtype=bool)
        return np.asarray(self.free[:, d] >= only)

    def _go(
        self,
        chain: NDArray[np.int64],
        rates: NDArray[np.float64],
        closing: NDArray[np.float64],
        frozen: NDArray[np.bool_],
    ) -> None:
        for joint, rate in zip(chain, rates, strict=True):
            low, high = self.covering.skeleton.limits[joint, _FLEXION]
            now = self.angles[:, joint, _FLEXION]
            far = np.where(np.isfinite(closing), now + rate * closing, high)
            ahead = np.maximum(now, np.clip(far, low, high))
            self.angles[:, joint, _FLEXION] = np.where(frozen, now, ahead)

    def gap(self, joints: NDArray[np.int64], angles: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Smallest signed distance of every digit's skin to the object [m], shape (G, D)."""
        poses = self.poses(angles)
        out = np.empty((len(self.angles), len(joints)))
        for d, chain in enumerate(joints):
            points = self.covering.points(poses, _moved(self.covering, int(chain[0])))
            found = self.objects.distances(points, which=self.which, places=self.places, threads=self.threads)
            out[:, d] = found.distance.min(axis=1)
        return out

    def settle(self, joints: NDArray[np.int64]) -> None:
        """Open base joints where skin that swelled has entered the object, and close again what lies beyond."""
        allowed = -2.0 * self.tolerance
        for _ in range(3):
            deep = self.gap(joints) < allowed
            if not deep.any():
                return
            low = np.where(deep, 1.0, 0.0) * _WIDEST
            high = np.zeros_like(low)  # opening that is too small … opening that is enough
            enough = low.copy()
            for _ in range(_HALVINGS):
                middle = 0.5 * (high + enough)
                clear = self.gap(joints, self._opened(joints, middle)) >= allowed
                enough, high = np.where(clear, middle, enough), np.where(clear, high, middle)
            self.angles = self._opened(joints, np.where(deep, enough, 0.0))

    def _opened(self, joints: NDArray[np.int64], by: NDArray[np.float64]) -> NDArray[np.float64]:
        angles = self.angles.copy()
        for d, chain in enumerate(joints):
            base = int(chain[0])
            now, start = angles[:, base, _FLEXION], self.open[:, base, _FLEXION]
            angles[:, base, _FLEXION] = np.maximum(now - by[:, d], np.minimum(start, now))
        return angles
