"""The nodes of a glTF file that a motion concerns: its joints and all that they hang on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.motion.out.local_motion import nearest_rotations

__all__ = ["NodeTree"]


@dataclass(frozen=True, eq=False)
class NodeTree:
    """n nodes, N of which are a motion's joints.

    Attributes:
        records: The nodes in the file's JSON.
        numbers: Their numbers in the file, shape (n,).
        parents: Parent of every node, numbered here, -1 for none, shape (n,).
        rest: Node-to-parent transforms at rest, shape (n, 4, 4).
        rest_worlds: Node-to-world transforms at rest, shape (n, 4, 4).
        scales: Scale in ``rest``, shape (n, 3).
        joints: Which node each joint is, shape (N,).
        worlds: Gives joint-to-world transforms of a range of f frames, shape (f, N, 4, 4).
    """

    records: list[dict[str, Any]]
    numbers: NDArray[np.int64]
    parents: NDArray[np.int64]
    rest: NDArray[np.float64]
    rest_worlds: NDArray[np.float64]
    scales: NDArray[np.float64]
    joints: NDArray[np.int64]
    worlds: Callable[[slice], NDArray[np.float64]]

    @property
    def size(self) -> float:
        """Diagonal of the box around the joints at rest, in the file's units."""
        return float(np.linalg.norm(np.ptp(self.rest_worlds[self.joints, :3, 3], axis=0))) or 1.0

    @property
    def reach(self) -> NDArray[np.float64]:
        """How far a unit of a joint's translation goes in the world, shape (N,)."""
        above = self.parents[self.joints]
        lengths = np.linalg.norm(self.rest_worlds[above, :3, :3], axis=1).max(axis=-1)
        return np.where(above >= 0, lengths, 1.0)

    def under(self, moved: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Joints that are moved, or hang on one that is, shape (N,)."""
        nodes = np.zeros(len(self.parents), dtype=bool)
        nodes[self.joints[moved]] = True
        for node in range(len(nodes)):
            above = node
            while above >= 0 and not nodes[above]:
                above = int(self.parents[above])
            if above >= 0:
                nodes[node] = True
        return nodes[self.joints]

    def make_animatable(self, joint: int) -> None:
        """Animated nodes must not have a matrix: write translation, rotation and scale in its place."""
        node = int(self.joints[joint])
        record, rest, scale = self.records[self.numbers[node]], self.rest[node], self.scales[node]
        if record.pop("matrix", None) is None:
            return
        turn = nearest_rotations(rest[None, :3, :3] / np.where(scale == 0.0, 1.0, scale))[0]
        record["translation"] = rest[:3, 3].tolist()
        record["rotation"] = Rotation.from_matrix(turn).as_quat().tolist()
        record["scale"] = scale.tolist()
