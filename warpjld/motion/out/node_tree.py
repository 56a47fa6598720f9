"""The nodes of a glTF file that a motion affects: its joints and all their ancestors."""

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
    """n nodes, of which N are a motion's joints.

    Attributes:
        records: The nodes in the file's JSON.
        numbers: Their indices in the file, shape (n,).
        parents: Parent of every node, as an index into these nodes, -1 for none, shape (n,).
        rest: Node-to-parent transforms at rest, shape (n, 4, 4).
        rest_worlds: Node-to-world transforms at rest, shape (n, 4, 4).
        scales: Scale in ``rest``, shape (n, 3).
        joints: Node of each joint, shape (N,).
        worlds: Function from a range of f frames to joint-to-world transforms, shape (f, N, 4, 4).
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
        """Diagonal of the joints' bounding box at rest, in the file's units."""
        return float(np.linalg.norm(np.ptp(self.rest_worlds[self.joints, :3, 3], axis=0))) or 1.0

    @property
    def reach(self) -> NDArray[np.float64]:
        """World length of a unit of each joint's translation, shape (N,)."""
        above = self.parents[self.joints]
        lengths = np.linalg.norm(self.rest_worlds[above, :3, :3], axis=1).max(axis=-1)
        return np.where(above >= 0, lengths, 1.0)

    def under(self, moved: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Mask of joints that are moved or descend from a moved one, shape (N,)."""
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
        """Replace a node's matrix by translation, rotation and scale, as glTF requires of animated nodes."""
        node = int(self.joints[joint])
        record, rest, scale = self.records[self.numbers[node]], self.rest[node], self.scales[node]
        if record.pop("matrix", None) is None:
            return
        turn = nearest_rotations(rest[None, :3, :3] / np.where(scale == 0.0, 1.0, scale))[0]
        record["translation"] = rest[:3, 3].tolist()
        record["rotation"] = Rotation.from_matrix(turn).as_quat().tolist()
        record["scale"] = scale.tolist()
