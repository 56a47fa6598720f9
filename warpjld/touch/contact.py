"""The skin's contact over a sequence, block by block, and what is told of it afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.digits import digit_joints
from warpjld.skeleton.kinematics import Poses

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering
    from warpjld.grasp.distance import ObjectSet
    from warpjld.grasp.objects import GraspObject, Places
    from warpjld.touch.limit import LimitedDigit
    from warpjld.touch.touch import Touch, Touched

__all__ = ["SkinContact"]


class SkinContact:
    """What ``deform --touch`` and ``TOUCH`` do to a covering's poses and surfaces.

    Args:
        covering: The covering.
        limits: Whether digits close only until they touch.
    """

    def __init__(self, covering: Covering, *, limits: bool) -> None:
        self._covering = covering
        self._limits = limits
        self._closed: dict[tuple[str, int], LimitedDigit] = {}
        self._deep: set[tuple[str, int]] = set()
        self._deepest: dict[str, tuple[Touched, Poses]] = {}
        self._objects: dict[int, ObjectSet] = {}
        self._in_objects: dict[tuple[str, str], Touched] = {}

    @cached_property
    def touch(self) -> Touch:
        """The contact of the covering's own parts."""
        from warpjld.touch.touch import Touch

        return Touch.of(self._covering)

    def poses(self, poses: Poses, *, first: int = 0) -> Poses:
        """The poses, with digits closed only until they touch where that is wanted."""
        if not self._limits:
            return poses
        from warpjld.touch.limit import close_until_touch

        limited, closed = close_until_touch(self._covering, poses, self.touch, first=first)
        self._closed.update({(one.digit, one.frame): one for one in closed})
        return limited

    def skin(self, points: NDArray[np.float32], poses: Poses, *, first: int = 0) -> NDArray[np.float32]:
        """Surfaces (F, V, 3) of poses, the frames from ``first`` on, what crosses parted."""
        parted, deep = self.touch.apply(points, poses, first=first)
        for one in deep:
            worst = self._deepest.get(one.part)
            self._deep.add((one.part, one.frame))  # a frame may be asked for twice
            if worst is None or one.depth > worst[0].depth:
                k = one.frame - first
                self._deepest[one.part] = one, poses[k : k + 1]
        return np.asarray(parted, dtype=np.float32)

    def hold(
        self, points: NDArray[np.float32], held: Sequence[tuple[GraspObject, Places]], *, first: int = 0
    ) -> NDArray[np.float32]:
        """Surfaces (F, V, 3) with skin that lies inside rigid objects flattened on them; F places of each."""
        from warpjld.grasp.distance import ObjectSet
        from warpjld.touch.held import flatten_on

        for thing, places in held:
            if id(thing) not in self._objects:
                self._objects[id(thing)] = ObjectSet(thing)
            points, deep = flatten_on(self.touch, points, self._objects[id(thing)], [places], first=first)
            for one in deep:
                worst = self._in_objects.setdefault((one.part, one.other), one)
                if one.depth > worst.depth:
                    self._in_objects[one.part, one.other] = one
        return points

    def told(self) -> list[str]:
        """A line a digit that was closed less, and one a digit or part that lies too deep in another, each at its
        worst."""
        lines = self._too_coarse()
        for name in dict.fromkeys(digit for digit, _ in self._closed):
            mine = [one for (digit, _), one in self._closed.items() if digit == name]
            stuck = [one.frame for one in mine if one.crosses]
            if stuck:
                lines.append(
                    f"{name}: {_frames(len(stuck))} cross something however far it opens, as at frame {stuck[0]}"
                )
            closed = [one for one in mine if one.share < 1.0]
            if closed:
                worst = max(closed, key=lambda one: one.depth)
                inside = f"{1e3 * worst.depth:.1f} mm inside {worst.other} as posed" if worst.other else "folded"
                lines.append(
                    f"{name}: {_frames(len(closed))} closed only until it touches, deepest at frame {worst.frame}: "
                    f"{inside}, touches at {worst.flexion:.0f}° of flexion in all"
                )
        lines += self._too_deep()
        lines += [
            f"{one.part}: {1e3 * one.depth:.1f} mm inside {one.other} at frame {one.frame}, more than skin can give"
            for one in self._in_objects.values()
        ]
        return lines

    def _too_coarse(self) -> list[str]:
        """Parts of digits that cannot be parted: what else is too coarse seldom touches anything."""
        digits = digit_joints(self._covering.skeleton)
        pairs = zip(self.touch.patches.names, self.touch.coarse, strict=True)
        names = [name for name, coarse in pairs if coarse and name.rpartition(".")[0] in digits]
        if not names:
            return []
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return [f"touch: {', '.join(names[:3])}{more}: edges too long for such thin flesh; nothing is parted there"]

    def _too_deep(self) -> list[str]:
        """By digit, with the flexion at which it touches; parts of the body by themselves."""
        from warpjld.touch.limit import close_until_touch

        digits = digit_joints(self._covering.skeleton)
        by_name: dict[str, list[str]] = {}
        for part in self._deepest:
            stem = part.rpartition(".")[0]
            by_name.setdefault(stem if stem in digits else part, []).append(part)
        lines = []
        for name, parts in by_name.items():
            worst, pose = max((self._deepest[part] for part in parts), key=lambda pair: pair[0].depth)
            frames = len({frame for part, frame in self._deep if part in parts})
            touches = ""
            if name in digits:
                closed = [one for one in close_until_touch(self._covering, pose, self.touch)[1] if one.digit == name]
                touches = f"; it touches at {closed[0].flexion:.0f}° of flexion in all" if closed else ""
            lines.append(
                f"{name}: {1e3 * worst.depth:.1f} mm inside {worst.other} at frame {worst.frame} "
                f"({_frames(frames)} in all), more than skin can give{touches}"
            )
        return lines


def _frames(count: int) -> str:
    return f"{count} frame{'s' * (count != 1)}"
