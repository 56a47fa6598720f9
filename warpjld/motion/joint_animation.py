"""Animation of a joint tree by world transforms of every joint and frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import upright
from warpjld.geometry.scales import polar
from warpjld.motion.clip import Clip
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.recognise.tree import SourceTree

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["JointAnimation"]


@dataclass(frozen=True, eq=False)
class JointAnimation:
    """F frames of a joint tree, in its file's names, order, units and axes.

    Attributes:
        tree: The joints and their rest; of a file that also holds a rig, the same joints in the same order as that
            rig's ``source``.
        worlds: Joint-to-world transforms, shape (F, N, 4, 4). Zero scale is replaced by a tiny one, and axes are not
            mirrored where they were not at rest (see ``warpjld.geometry.scales``), so that every frame has a rotation.
        rate: Frames a second.
        title: The animation's name; "" where the file gives none.
        notes: Information for the user of the result.
        warnings: What of the file is ignored.
        up: The file's up axis, ``y`` or ``z``; None if it does not state one.
    """

    tree: SourceTree
    worlds: NDArray[np.float64]
    rate: float
    title: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    up: str | None = None

    def __len__(self) -> int:
        return len(self.worlds)

    def clip(self) -> Clip:
        """The animation as positions and rotations from rest, parents first, for retargeting.

        Rotated to Y up if the file states Z up.
        """
        order = np.array(sorted(range(len(self.tree)), key=lambda j: (self.tree.depth(j), j)))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        parents = self.tree.parents[order]
        turn = np.eye(4)
        turn[:3, :3] = upright(self.up)
        rest, worlds = turn @ self.tree.frames[order], turn @ self.worlds[:, order]
        turned, _ = polar(worlds[..., :3, :3] @ np.linalg.inv(rest[:, :3, :3]))
        return Clip(
            names=tuple(self.tree.names[j] for j in order),
            parents=np.where(parents >= 0, place[parents], -1),
            rest=rest[:, :3, 3],
            positions=worlds[..., :3, 3],
            rotations=transform.Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat().reshape(*worlds.shape[:2], 4),
            rate=self.rate,
        )
