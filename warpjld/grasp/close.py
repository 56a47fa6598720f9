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
_CUTS, _PIECES = 3, 8  # the opening is found to a 512th of that
_ROUNDS = 4  # of bending and opening again
_TOUCH = 1e-4  # skin this near touches [m]


@dataclass(frozen=True, eq=False)
class Closed:
    """Hands closed from G postures.

    Attributes:
        angles: Joint angles [rad], shape (G, J, 4).
        digits: Names of the digits that closed, e.g. ``left.index``.
        status: Per digit and joint how its search ended (values of ``Status``), shape (G, D, 3); CONVERGED is a touch,
            NO_CONTACT the limit reached without one.
        gap: Smallest signed distance of every digit's skin to the object [m], shape (G, D).
        penetration: Deepest vertex of the digits inside the object [m], shape (G,).
    """

    angles: NDArray[np.float64]
    digits: tuple[str, ...]
    status: NDArray[np.int32]
    gap: NDArray[np.float64]
    penetration: NDArray[np.float64]

    def touching(self) -> NDArray[np.bool_]:
        """Digits within a tenth of a millimetre of the object, shape (G, D)."""
        return np.asarray(self.gap < _TOUCH)


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
    anchors = covering.anchors
    beyond = _beyond(covering.skeleton, joint)
    share = (anchors.weight * beyond[anchors.ends[anchors.segment, 0]]).sum(axis=1)
    return np.flatnonzero(share >= _OWN).astype(np.int32)


@lru_cache(maxsize=32)
def _moving(covering: Covering, bases: tuple[int, ...]) -> NDArray[np.int32]:
    """Vertices that move at all when digits bend, those of the palm that swell included."""
    anchors = covering.anchors
    beyond = np.any([_beyond(covering.skeleton, base) for base in bases], axis=0)
    touched = beyond[anchors.ends[anchors.segment]].any(axis=2)
    return np.flatnonzero(((anchors.weight > 0.0) & touched).any(axis=1)).astype(np.int32)


def _beyond(skeleton: Skeleton, joint: int) -> NDArray[np.bool_]:
    """Joints at or beyond a joint, shape (J,)."""
    out = np.zeros(len(skeleton), dtype=bool)
    for j, parent in enumerate(skeleton.parents):
        out[j] = j == joint or (parent >= 0 and out[parent])
    return out


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
    if coupling is not None:
        hand.bend(joints, np.array([1.0, *coupling]))
    for again in range(_ROUNDS):
        for k in range(1 if again else 0, 3):
            # a joint with a touch at or beyond its segment finds it at once and stays
            ended = hand.bend(joints[:, k:], np.array([1.0, 0.0, 0.0])[: 3 - k])
            # skin left inside by less than twice the tolerance is a touch
            ended = np.where(ended == int(Status.INSIDE), int(Status.CONVERGED), ended) if again else ended
            status[..., k] = ended
        if not hand.settle(joints):
            break
    if apart:
        for g in range(count):
            hand.angles[g], stopped = keep_apart(covering, partial(hand.poses_of, g), angles[g], hand.angles[g], chains)
            for name in stopped:
                status[g, names.index(name)] = int(Status.BLOCKED)
    gap = np.stack([hand.distances(_moved(covering, int(chain[0]))).min(axis=1) for chain in joints], axis=1)
    penetration = -hand.distances(_moving(covering, tuple(joints[:, 0].tolist()))).min(axis=1)
    return Closed(hand.angles, tuple(names), status, gap, np.maximum(0.0, penetration))


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
        self._floor: NDArray[np.float64] | None = None
        rest = poses_from_angles(covering.skeleton, angles)
        turn = Rotation.from_quat(poses.rotations[:, 0]) * Rotation.from_quat(rest.rotations[:, 0]).inv()
        self._turn = turn.as_quat()
        self._shift = poses.positions[:, 0] - covering.skeleton.rest[0]

    def poses(self, angles: NDArray[np.float64] | None = None) -> Poses:
        """Poses of the present, or of k times G hands with other angles."""
        wanted = self.angles if angles is None else angles
        again = len(wanted) // len(self.angles)
        return poses_from_angles(
            self.covering.skeleton,
            wanted,
            root_position=np.tile(self._shift, (again, 1)),
            root_rotation=np.tile(self._turn, (again, 1)),
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

    def bend(self, joints: NDArray[np.int64], rates: NDArray[np.float64]) -> NDArray[np.int32]:
        """Bend the joints of every digit (D, k) at these rates until the first touch; how each ended, shape (G, D)."""
        count = len(self.angles)
        vertices = [_moved(self.covering, int(chain[0])) for chain in joints]
        owner = np.concatenate([np.full(len(v), d) for d, v in enumerate(vertices)])
        vertex = np.concatenate(vertices)
        moving = rates != 0.0
        frame = np.repeat(np.arange(count), len(vertex))
        used = joints[:, moving][np.tile(owner, count)]
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
                distance=self.tolerance,
            ),
            places=self.places,
            tolerance=self.tolerance,
            threads=self.threads,
        )
        status = found.status.reshape(count, -1)
        free = (status == Status.NO_CONTACT) | (status == Status.AT_LIMIT)
        closing = np.where(free, np.inf, found.closing.reshape(count, -1))
        ended = np.empty((count, len(joints)), dtype=np.int32)
        rows = np.arange(count)
        for d, chain in enumerate(joints):
            own = owner == d
            first = closing[:, own].argmin(axis=1)
            best = closing[:, own][rows, first]
            ended[:, d] = np.where(np.isfinite(best), status[:, own][rows, first], int(Status.NO_CONTACT))
            for joint, rate in zip(chain[moving], rates[moving], strict=True):
                low, high = self.covering.skeleton.limits[joint, _FLEXION]
                now = self.angles[:, joint, _FLEXION]
                far = np.where(np.isfinite(best), now + rate * best, high)
                self.angles[:, joint, _FLEXION] = np.maximum(now, np.clip(far, low, high))
        return ended

    def distances(self, vertices: NDArray[np.int32], angles: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Signed distances of some vertices to the object [m], shape (G, n); of k times G hands with other angles."""
        points = self.covering.points(self.poses(angles), vertices)
        again = len(points) // len(self.which)
        places = Places(np.tile(self.places.position, (again, 1)), np.tile(self.places.rotation, (again, 1)))
        found = self.objects.distances(points, which=np.tile(self.which, again), places=places, threads=self.threads)
        return found.distance.astype(np.float64)

    def settle(self, joints: NDArray[np.int64]) -> bool:
        """Open base joints where skin that swelled has entered the object; whether any had to.

        What was inside before the hand closed does not count.
        """
        bases = joints[:, 0].tolist()
        vertices = _moving(self.covering, tuple(bases))
        now = self.distances(vertices)
        if self._floor is None:
            self._floor = np.minimum(-2.0 * self.tolerance, self.distances(vertices, self.open) - 1e-6)
        some = (now < self._floor).any(axis=0)
        if not some.any():
            return False
        vertices, now, allowed = vertices[some], now[:, some], self._floor[:, some]
        deep = now < allowed
        wide = np.full(len(self.angles), _WIDEST)
        at_widest = np.stack([self.distances(vertices, self._opened(base, wide)) for base in bases])
        # a vertex is brought out by the digit whose opening moves it most
        culprit = np.where((at_widest - now).max(axis=0) > 1e-6, (at_widest - now).argmax(axis=0), -1)
        for d, base in enumerate(bases):
            own = deep & (culprit == d)
            if not own.any():
                continue
            some = own.any(axis=0)
            floor = np.where(own, np.minimum(allowed, at_widest[d] - 1e-7), -np.inf)[:, some]
            short, enough, rows = np.zeros_like(wide), wide.copy(), np.arange(len(wide))
            for _ in range(_CUTS):
                parts = np.linspace(0.0, 1.0, _PIECES + 1)[1:, None]
                by = short + parts * (enough - short)
                angles = np.concatenate([self._opened(base, row) for row in by])
                gap = self.distances(vertices[some], angles).reshape(_PIECES, len(wide), -1)
                good = (gap >= floor).all(axis=2)
                first = np.where(good.any(axis=0), good.argmax(axis=0), _PIECES - 1)
                before = np.where(first > 0, by[first - 1, rows], short)
                enough, short = by[first, rows], before
            self.angles = self._opened(base, np.where(own.any(axis=1), enough, 0.0))
        return True

    def _opened(self, base: int, by: NDArray[np.float64]) -> NDArray[np.float64]:
        angles = self.angles.copy()
        now, start = angles[:, base, _FLEXION], self.open[:, base, _FLEXION]
        angles[:, base, _FLEXION] = np.maximum(now - by, np.minimum(start, now))
        return angles
