"""Key-framed placement of actors and objects: displacement and rotation of the whole."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.motion import Key, Track
from warpjld.skeleton import Poses

if TYPE_CHECKING:
    from warpjld.grasp import Places

__all__ = ["Placement"]

_AXES = "xyz"


@dataclass(eq=False)
class Placement:
    """Keys of six channels: ``move.x`` … [m] from the initial position, ``turn.x`` … [rad] about the root or origin."""

    tracks: dict[str, Track] = field(default_factory=dict)

    def set_key(self, channel: str, key: Key) -> None:
        """Set a key of a channel; it replaces one at the same frame."""
        self.tracks.setdefault(channel, Track(channel)).set(key)

    def values(self, kind: str, frames: NDArray[np.float64]) -> NDArray[np.float64]:
        """``move`` [m] or ``turn`` [rad] at F frames, shape (F, 3); 0 for channels without keys."""
        columns = [
            track.spline(frames) if (track := self.tracks.get(f"{kind}.{axis}")) else np.zeros(len(frames))
            for axis in _AXES
        ]
        return np.stack(columns, axis=-1)

    def apply(self, poses: Poses, frames: NDArray[np.float64]) -> Poses:
        """Poses of these frames, rotated about the root, then displaced."""
        if not self.tracks:
            return poses
        turn = Rotation.from_euler("xyz", self.values("turn", frames))
        root = poses.positions[:, :1]
        matrices = turn.as_matrix()[:, None]
        positions = root + np.squeeze(matrices @ (poses.positions - root)[..., None], -1)
        positions += self.values("move", frames)[:, None]
        return Poses(positions, _left_product(turn.as_quat(), poses.rotations), poses.flexion)

    def apply_to_places(self, places: Places, frames: NDArray[np.float64]) -> Places:
        """Placements of an object at these frames, rotated about its origin, then displaced."""
        from warpjld.grasp import Places

        if not self.tracks:
            return places
        turn = Rotation.from_euler("xyz", self.values("turn", frames)) * Rotation.from_quat(places.rotation)
        return Places(places.position + self.values("move", frames), turn.as_quat())


def _left_product(turn: NDArray[np.float64], rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion product of ``turn`` (F, 4) with joint rotations (F, J, 4), without changing the joints' signs."""
    vector, scalar = turn[:, None, :3], turn[:, None, 3:]
    v, s = rotations[..., :3], rotations[..., 3:]
    return np.concatenate(
        [scalar * v + s * vector + np.cross(vector, v), scalar * s - (vector * v).sum(-1, keepdims=True)], axis=-1
    )
