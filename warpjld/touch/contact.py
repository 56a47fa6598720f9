"""Skin contact over a sequence of frames, block by block, and the messages about it for the user."""

from __future__ import annotations

from array import array
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
    from warpjld.touch.limited_digits import LimitedDigits
    from warpjld.touch.touch import Touch, Touched

__all__ = ["SkinContact"]


class SkinContact:
    """Skin contact of ``deform --touch`` and ``TOUCH``: limits poses, separates surfaces, and collects messages.

    Args:
        covering: The covering.
        limits: Whether digits close only until they touch.
    """

    def __init__(self, covering: Covering, *, limits: bool) -> None:
        self._covering = covering
        self._limits = limits
        self._closed: LimitedDigits | None = None
        self._deep: dict[str, array[int]] = {}  # frames by part; a frame may be computed twice
        self._deepest: dict[str, tuple[Touched, Poses]] = {}
        self._objects: dict[int, ObjectSet] = {}
        self._in_objects: dict[tuple[str, str], Touched] = {}

    @cached_property
    def touch(self) -> Touch:
        """Contact between the covering's own parts."""
        from warpjld.touch.touch import Touch

        return Touch.of(self._covering)

    def poses(self, poses: Poses, *, first: int = 0) -> Poses:
        """The poses, or where ``limits`` is set, poses whose digits close only until they touch."""
        if not self._limits:
            return poses
        from warpjld.touch.limit import close_until_touch

        limited, closed = close_until_touch(self._covering, poses, self.touch, first=first)
        if self._closed is None:
            self._closed = closed
        else:
            self._closed.add_all(closed)
        return limited

    def skin(self, points: NDArray[np.float32], poses: Poses, *, first: int = 0) -> NDArray[np.float32]:
        """Surfaces [m] (F, V, 3) of the frames from ``first`` on, with overlapping skin separated."""
        parted, deep = self.touch.apply(points, poses, first=first)
        for overlap in deep:
            worst = self._deepest.get(overlap.part)
            self._deep.setdefault(overlap.part, array("q")).append(overlap.frame)
            if worst is None or overlap.depth > worst[0].depth:
                k = overlap.frame - first
                self._deepest[overlap.part] = overlap, poses[k : k + 1]
        return np.asarray(parted, dtype=np.float32)

    def hold(
        self, points: NDArray[np.float32], held: Sequence[tuple[GraspObject, Places]], *, first: int = 0
    ) -> NDArray[np.float32]:
        """Surfaces [m] (F, V, 3) with skin inside rigid objects flattened onto them; F places of each object."""
        from warpjld.grasp.distance import ObjectSet
        from warpjld.touch.held import flatten_on

        for held_object, places in held:
            if id(held_object) not in self._objects:
                self._objects[id(held_object)] = ObjectSet(held_object)
            points, deep = flatten_on(self.touch, points, self._objects[id(held_object)], [places], first=first)
            for overlap in deep:
                worst = self._in_objects.setdefault((overlap.part, overlap.other), overlap)
                if overlap.depth > worst.depth:
                    self._in_objects[overlap.part, overlap.other] = overlap
        return points

    def messages(self) -> list[str]:
        """Messages for the user: a line for each digit that was closed less than posed, and one for each digit or part
        that lies too deep in another, with its worst frame."""
        lines = self._too_coarse()
        lines += self._closed_less()
        lines += self._too_deep()
        lines += [
            f"{deep.part}: {1e3 * deep.depth:.1f} mm inside {deep.other} at frame {deep.frame}, more than skin can give"
            for deep in self._in_objects.values()
        ]
        return lines

    def _closed_less(self) -> list[str]:
        """Messages about digits whose closing was limited."""
        found, lines = self._closed, []
        for name, rows in ({} if found is None else found.by_digit()).items():
            assert found is not None
            stuck = rows[rows["crosses"]]
            if len(stuck):
                lines.append(
                    f"{name}: {_frames(len(stuck))} cross something however far it opens, as at frame "
                    f"{stuck['frame'][0]}"
                )
            closed = rows[rows["share"] < 1.0]
            if len(closed):
                worst = found.record(closed[closed["depth"].argmax()])
                inside = f"{1e3 * worst.depth:.1f} mm inside {worst.other} as posed" if worst.other else "folded"
                lines.append(
                    f"{name}: {_frames(len(closed))} closed only until it touches, deepest at frame {worst.frame}: "
                    f"{inside}, touches at {worst.flexion:.0f}° of flexion in all"
                )
        return lines

    def _too_coarse(self) -> list[str]:
        """Message about parts of digits whose mesh is too coarse for separation; other parts seldom touch anything."""
        digits = digit_joints(self._covering.skeleton)
        pairs = zip(self.touch.patches.names, self.touch.coarse, strict=True)
        names = [name for name, coarse in pairs if coarse and name.rpartition(".")[0] in digits]
        if not names:
            return []
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        return [f"touch: {', '.join(names[:3])}{more}: edges too long for such thin flesh; skin is not parted there"]

    def _too_deep(self) -> list[str]:
        """Messages about overlaps that are too deep: one for each digit, with the flexion at which it touches, and one
        for each other part."""
        from warpjld.touch.limit import close_until_touch

        digits = digit_joints(self._covering.skeleton)
        by_name: dict[str, list[str]] = {}
        for part in self._deepest:
            stem = part.rpartition(".")[0]
            by_name.setdefault(stem if stem in digits else part, []).append(part)
        lines = []
        for name, parts in by_name.items():
            worst, pose = max((self._deepest[part] for part in parts), key=lambda pair: pair[0].depth)
            frames = len(np.unique(np.concatenate([self._deep[part] for part in parts])))
            touches = ""
            if name in digits:
                limits = close_until_touch(self._covering, pose, self.touch)[1]
                closed = [limit for limit in limits if limit.digit == name]
                touches = f"; it touches at {closed[0].flexion:.0f}° of flexion in all" if closed else ""
            lines.append(
                f"{name}: {1e3 * worst.depth:.1f} mm inside {worst.other} at frame {worst.frame} "
                f"({_frames(frames)} in all), more than skin can give{touches}"
            )
        return lines


def _frames(count: int) -> str:
    return f"{count} frame{'s' * (count != 1)}"
