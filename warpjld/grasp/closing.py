"""Hands on their way: bending joints until the first touch, and opening them where swelling skin went too far."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.found import Status
from warpjld.grasp.moved import skin_beyond, skin_that_moves
from warpjld.grasp.objects import Places
from warpjld.grasp.search import FlexionSearch
from warpjld.grasp.searches import Searches
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

__all__ = ["ClosingHands"]

_FLEXION = CHANNELS.index("flexion")
_WIDEST = 0.35  # how far a base joint may open again for the sake of swelling skin [rad]
_CUTS, _PIECES = 3, 8  # the opening is found to a 512th of that


class ClosingHands:
    """G hands, each with its object.

    Args:
        covering: The hand, smooth method.
        poses: G postures to start from, open.
        angles: Their joint angles [rad], shape (G, J, 4).
        objects: Search structures.
        which: Object of every hand, shape (G,).
        places: Place of every hand's object.
        every: Every so many vertices search for a touch.
        tolerance: Distance that counts as a touch [m].
        threads: CPU threads.

    Attributes:
        angles: As they are now, shape (G, J, 4).

    Raises:
        InputError: Postures of another skeleton.
    """

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        angles: NDArray[np.float64],
        objects: ObjectSet,
        which: NDArray[np.int32],
        places: Places,
        *,
        every: int,
        tolerance: float,
        threads: int | None,
    ) -> None:
        covering.check(poses)
        self.angles = angles.copy()
        self._covering, self._open = covering, angles
        self._objects, self._which, self._places = objects, which, places
        self._every, self._tolerance, self._threads = every, tolerance, threads
        self._search = FlexionSearch(covering, objects)
        self._skin_beyond = cache(partial(skin_beyond, covering))
        self._floor: NDArray[np.float64] | None = None
        rest = poses_from_angles(covering.skeleton, angles)
        turn = Rotation.from_quat(poses.rotations[:, 0]) * Rotation.from_quat(rest.rotations[:, 0]).inv()
        self._turn = turn.as_quat()
        self._shift = poses.positions[:, 0] - covering.skeleton.rest[0]

    def __len__(self) -> int:
        return len(self.angles)

    def poses_of(self, hands: NDArray[np.int64] | int, angles: NDArray[np.float64]) -> Poses:
        """Poses with angles (n, J, 4) of n hands, or of one hand n times, each placed as it was at the start."""
        chosen = np.broadcast_to(hands, len(angles))
        return poses_from_angles(
            self._covering.skeleton, angles, root_position=self._shift[chosen], root_rotation=self._turn[chosen]
        )

    def skin_gaps(self, bases: list[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How far the skin is from the object, the object's edges left aside.

        Args:
            bases: First joints of D digits.

        Returns:
            Smallest signed distance of every digit [m], shape (G, D), and depth of all skin that moves, shape (G,).
        """
        gap = np.stack([self._distances(self._skin_beyond(base)).min(axis=1) for base in bases], axis=1)
        depth = -self._distances(skin_that_moves(self._covering, bases)).min(axis=1)
        return gap, np.maximum(0.0, depth)

    def bend(self, joints: NDArray[np.int64], rates: NDArray[np.float64]) -> NDArray[np.int32]:
        """Bend the joints of every digit (D, k) at these rates until the first touch; how each ended, shape (G, D)."""
        count = len(self)
        vertices = [self._skin_beyond(int(chain[0]))[:: self._every] for chain in joints]
        owner = np.repeat(np.arange(len(joints)), [len(v) for v in vertices])
        moving = rates != 0.0
        frame = np.repeat(np.arange(count), len(owner))
        used = joints[:, moving][np.tile(owner, count)]
        found = self._search.run(
            self.poses_of(np.arange(count), self.angles),
            self.angles,
            Searches(
                vertex=np.tile(np.concatenate(vertices), count),
                joint=used,
                frame=frame,
                thing=self._which[frame],
                place=frame,
                rate=np.broadcast_to(rates[moving], used.shape),
                distance=self._tolerance,
            ),
            places=self._places,
            tolerance=self._tolerance,
            threads=self._threads,
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
                low, high = self._covering.skeleton.limits[joint, _FLEXION]
                now = self.angles[:, joint, _FLEXION]
                far = np.where(np.isfinite(best), now + rate * best, high)
                self.angles[:, joint, _FLEXION] = np.maximum(now, np.clip(far, low, high))
        return ended

    def settle(self, bases: list[int]) -> NDArray[np.bool_]:
        """Open base joints where skin that swelled has entered the object; which hands had to, shape (G,).

        What was inside before the hand closed does not count.
        """
        vertices = skin_that_moves(self._covering, bases)
        now = self._distances(vertices)
        if self._floor is None:
            self._floor = np.minimum(-2.0 * self._tolerance, self._distances(vertices, self._open) - 1e-6)
        some = (now < self._floor).any(axis=0)
        if not some.any():
            return np.zeros(len(self), dtype=bool)
        vertices, now, allowed = vertices[some], now[:, some], self._floor[:, some]
        deep = now < allowed
        widest = np.full(len(self), _WIDEST)
        at_widest = np.stack([self._distances(vertices, self._opened(base, widest)) for base in bases])
        # a vertex is brought out by the digit whose opening moves it most
        culprit = np.where((at_widest - now).max(axis=0) > 1e-6, (at_widest - now).argmax(axis=0), -1)
        for d, base in enumerate(bases):
            own = deep & (culprit == d)
            if own.any():
                some = own.any(axis=0)
                floor = np.where(own, np.minimum(allowed, at_widest[d] - 1e-7), -np.inf)[:, some]
                enough = self._least_opening(base, vertices[some], floor)
                self.angles = self._opened(base, np.where(own.any(axis=1), enough, 0.0))
        return np.asarray(deep.any(axis=1))

    def _least_opening(self, base: int, vertices: NDArray[np.int32], floor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least opening of a base joint [rad] that brings vertices to their least distances (G, n), shape (G,)."""
        short, enough, rows = np.zeros(len(self)), np.full(len(self), _WIDEST), np.arange(len(self))
        for _ in range(_CUTS):
            parts = np.linspace(0.0, 1.0, _PIECES + 1)[1:, None]
            by = short + parts * (enough - short)
            angles = np.concatenate([self._opened(base, row) for row in by])
            gap = self._distances(vertices, angles).reshape(_PIECES, len(self), -1)
            good = (gap >= floor).all(axis=2)
            first = np.where(good.any(axis=0), good.argmax(axis=0), _PIECES - 1)
            before = np.where(first > 0, by[first - 1, rows], short)
            enough, short = by[first, rows], before
        return enough

    def _opened(self, base: int, by: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angles (G, J, 4) with a base joint opened by some more (G,) [rad], no farther than it began."""
        angles = self.angles.copy()
        now, start = angles[:, base, _FLEXION], self._open[:, base, _FLEXION]
        angles[:, base, _FLEXION] = np.maximum(now - by, np.minimum(start, now))
        return angles

    def _distances(self, vertices: NDArray[np.int32], angles: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Signed distances of some vertices to the object [m], shape (k · G, n), with angles (k · G, J, 4)."""
        wanted = self.angles if angles is None else angles
        hands = np.arange(len(wanted)) % len(self)
        points = self._covering.points(self.poses_of(hands, wanted), vertices)
        found = self._objects.distances(
            points, which=self._which[hands], places=self._places[hands], threads=self._threads
        )
        return found.distance.astype(np.float64)
