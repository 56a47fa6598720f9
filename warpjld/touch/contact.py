"""The skin's contact over a sequence, block by block, and what is told of it afterwards."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.kinematics import Poses

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering
    from warpjld.touch.limit import Closed
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
        self._closed: dict[tuple[str, int], Closed] = {}
        self._deep: dict[tuple[str, int], Touched] = {}

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

    def skin(self, points: NDArray[np.float32], *, first: int = 0) -> NDArray[np.float32]:
        """Surfaces (F, V, 3) of the frames from ``first`` on, what crosses parted."""
        parted, deep = self.touch.apply(points, first=first)
        self._deep.update({(one.part, one.frame): one for one in deep})  # a frame may be asked for twice
        return np.asarray(parted, dtype=np.float32)

    def told(self) -> list[str]:
        """A line a digit that was closed less, and one a part that lies too deep in another, each at its worst."""
        lines = []
        for name in dict.fromkeys(digit for digit, _ in self._closed):
            mine = [one for (digit, _), one in self._closed.items() if digit == name]
            worst = max(mine, key=lambda one: (one.share == 1.0, one.depth))
            where = f"{name}: {len(mine)} frame{'s' * (len(mine) != 1)}"
            if worst.share == 1.0:
                lines.append(f"{where} cross something however far it opens, as at frame {worst.frame}: left as posed")
            else:
                lines.append(
                    f"{where} closed only until it touches, deepest at frame {worst.frame}: {1e3 * worst.depth:.1f} mm "
                    f"inside as posed, touches at {worst.flexion:.0f}° of flexion in all"
                )
        for name in dict.fromkeys(part for part, _ in self._deep):
            mine_deep = [one for (part, _), one in self._deep.items() if part == name]
            deepest = max(mine_deep, key=lambda one: one.depth)
            lines.append(
                f"{name}: {1e3 * deepest.depth:.1f} mm inside {deepest.other} at frame {deepest.frame} "
                f"({len(mine_deep)} in all): more than skin can give, a pose nobody can take; not parted in full"
            )
        return lines
