"""Joint tree of a file: any names, order and bone axes, possibly without a hierarchy."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["SourceTree"]


@dataclass(frozen=True, eq=False)
class SourceTree:
    """The N joints of a file.

    Attributes:
        names: The file's own names.
        parents: Nearest ancestor that is a joint, -1 for none, shape (N,); in any order.
        frames: Joint-to-world transforms at rest, shape (N, 4, 4).
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    frames: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Joint positions, shape (N, 3)."""
        return self.frames[:, :3, 3]

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Children of every joint."""
        found: list[list[int]] = [[] for _ in range(len(self))]
        for joint, above in enumerate(self._above):
            if above >= 0:
                found[above].append(joint)
        return tuple(map(tuple, found))

    @cached_property
    def _above(self) -> list[int]:
        """Parents as Python integers, which are faster to follow one by one."""
        return [int(above) for above in self.parents]

    @property
    def flat(self) -> bool:
        """Whether the file has no real hierarchy: more than four joints, of which at most one has children."""
        return len(self) > 4 and int((np.bincount(self.parents + 1, minlength=len(self) + 1)[1:] > 0).sum()) <= 1

    def own_name(self, joint: int) -> str:
        """The file's name of a joint; the second of several with the same name is ``name#2``."""
        name = self.names[joint]
        same = [j for j, other in enumerate(self.names) if other == name]
        return name if len(same) == 1 else f"{name}#{same.index(joint) + 1}"

    def depth(self, joint: int) -> int:
        """Number of ancestors."""
        return len(self.ancestors(joint))

    def ancestors(self, joint: int) -> list[int]:
        """Parent, grandparent, … of a joint."""
        above, out = self._above, []
        while (joint := above[joint]) >= 0:
            out.append(joint)
        return out

    def subtree(self, joint: int) -> list[int]:
        """A joint and its descendants, parents first."""
        out = [joint]
        for j in out:
            out.extend(self.children[j])
        return out
