"""Closing a hand: digits bend joint by joint until their skin touches the object (A §7, R76; R90)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.grasp.both_ways import BothWays, give_way
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.moved import joints_beyond, share_moved
from warpjld.grasp.objects import Places
from warpjld.grasp.search import FlexionSearch, Searches, Status
from warpjld.grasp.separate import keep_apart
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

__all__ = ["Closed", "close_hand"]

_FLEXION = CHANNELS.index("flexion")
_OWN = 0.5  # share of the operators at or beyond a joint from which a vertex counts as moved by it
_WIDEST = 0.35  # how far a base joint may open again for the sake of swelling skin [rad]
_CUTS, _PIECES = 3, 8  # the opening is found to a 512th of that
_ROUNDS = 4  # of bending and opening again
_TOUCH = 1e-4  # skin this near touches [m]
_PRESSED = 5e-4  # depth of an object's edges in the skin that stays [m]
_THROUGH = 1e-3  # the same of a digit on its way [m]
_QUICK = 3  # every third vertex searches at a first look


@dataclass(frozen=True, eq=False)
class Closed:
    """Hands closed from G postures.

    Attributes:
        angles: Joint angles [rad], shape (G, J, 4).
        digits: Names of the digits that closed, e.g. ``left.index``.
        status: Per digit and joint how its search ended (values of ``Status``), shape (G, D, 3); CONVERGED is a touch,
            NO_CONTACT the limit reached without one.
        gap: Smallest signed distance of every digit's skin and the object [m], looked at from both sides (see
            ``BothWays``), after a first look from the skin's only; shape (G, D).
        penetration: Depth of digits, or of the palm, and object in one another [m], likewise, shape (G,).
    """

    angles: NDArray[np.float64]
    digits: tuple[str, ...]
    status: NDArray[np.int32]
    gap: NDArray[np.float64]
    penetration: NDArray[np.float64]

    def touching(self) -> NDArray[np.bool_]:
        """Digits within a tenth of a millimetre of the object, shape (G, D)."""
        return np.asarray(self.gap < _TOUCH)


@lru_cache(maxsize=32)
def _moved(covering: Covering, joint: int) -> NDArray[np.int32]:
    """Vertices of which operators at or beyond a joint hold at least half."""
    return np.flatnonzero(share_moved(covering, joint) >= _OWN).astype(np.int32)


@lru_cache(maxsize=32)
def _moving(covering: Covering, bases: tuple[int, ...]) -> NDArray[np.int32]:
    """Vertices that move at all when digits bend, those of the palm that swell included."""
    anchors = covering.anchors
    beyond = np.any([joints_beyond(covering.skeleton, base) for base in bases], axis=0)
    touched = beyond[anchors.ends[anchors.segment]].any(axis=2)
    return np.flatnonzero(((anchors.weight > 0.0) & touched).any(axis=1)).astype(np.int32)


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
    quick: bool = False,
    tolerance: float = 1e-5,
    threads: int | None = None,
) -> Closed:
    """Close the digits of G hands, each on its object, in a few launches.

    Every digit bends at its base until a vertex beyond touches, then at its second joint, then at its third; a joint
    whose skin touches already stays. With ``coupling`` all three bend together until the first touch, the others at
    these times the base's rate; joints beyond the touch then go on together. Skin that swells as a finger bends may
    enter the object beside a touch: the base then opens as far as it must, and the joints beyond close again. What of
    the object, an edge or a corner, then is deeper than half a millimetre in the skin between its vertices, opens the
    digit it is in (``give_way``).

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
        quick: For a first look at many hands: a third of the vertices search, and nothing opens again; ``apart`` is
            left out.
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
    hand = _Hand(covering, poses, angles, objects, which, places, tolerance, threads, _QUICK if quick else 1)
    names = list(chains)
    status = np.full((count, len(names), 3), int(Status.NO_CONTACT), dtype=np.int32)
    joints = np.array([chains[name] for name in names])
    if coupling is not None:
        hand.bend(joints, np.array([1.0, *coupling]))
    for again in range(1 if quick else _ROUNDS):
        for k in range(1 if again else 0, 3):
            # a joint with a touch at or beyond its segment finds it at once and stays
            ended = hand.bend(joints[:, k:], np.array([1.0, 0.0, 0.0])[: 3 - k])
            # skin left inside by less than twice the tolerance is a touch
            ended = np.where(ended == int(Status.INSIDE), int(Status.CONVERGED), ended) if again else ended
            status[..., k] = ended
        if quick or not hand.settle(joints):
            break
    if quick:
        gap = np.stack([hand.distances(_moved(covering, int(chain[0]))).min(axis=1) for chain in joints], axis=1)
        depth = -hand.distances(_moving(covering, tuple(joints[:, 0].tolist()))).min(axis=1)
        return Closed(hand.angles, tuple(names), status, gap, np.maximum(0.0, depth))
    gap, depth = np.empty((count, len(names))), np.empty(count)
    both = [BothWays(covering, thing) for thing in objects.objects]
    for g in range(count):
        one, poses_of = both[which[g]], partial(hand.poses_of, g)

        def gaps(
            wanted: NDArray[np.float64],
            moved: bool = True,
            g: int = g,
            one: BothWays = one,
            poses_of: Callable[[NDArray[np.float64]], Poses] = poses_of,
        ) -> NDArray[np.float64]:
            skin = covering.deform(poses_of(wanted[None]), threads=threads)[0]
            return one.gaps(skin, places[g], moved=moved)

        hand.angles[g], _ = give_way(
            gaps, one.parts, angles[g], hand.angles[g], chains, allowed=_PRESSED, on_the_way=_THROUGH
        )
        if apart:
            hand.angles[g], stopped = keep_apart(covering, poses_of, angles[g], hand.angles[g], chains)
            for name in stopped:
                status[g, names.index(name)] = int(Status.BLOCKED)
        now = gaps(hand.angles[g], moved=False)
        gap[g] = now[[one.parts.index(name) for name in names]]
        depth[g] = max(0.0, -float(now.min()))
    return Closed(hand.angles, tuple(names), status, gap, depth)


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
        every: int,
    ) -> None:
        covering.check(poses)
        self.every = every
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
        vertices = [_moved(self.covering, int(chain[0]))[:: self.every] for chain in joints]
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
