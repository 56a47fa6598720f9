"""Retargeting of a tracked hand, given by joint positions only, to a rig's hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, minimal_rotation, multiply, rotate
from warpjld.motion.finger_bends import finger_bends, leaning
from warpjld.motion.hand_motion import IDENTITY, HandPart, HandTurns, hand_joints, root_carried
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton import DIGITS, Skeleton
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.streamed_poses import BLOCK

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["HandTrack"]

_PALM = ("wrist", *(f"{digit}.{joint}" for digit in DIGITS for joint in ("carpometacarpal", "base")))
_FARTHEST = 1e9
"""Largest plausible coordinate in any unit of length; squares of larger ones could overflow."""
_THIN = 0.01
"""Ratio of a palm's width to its length below which its orientation is undetermined."""
_MOBILE = ("ring.base", "pinky.base")
"""Palm points moved by the mobile metacarpals (R8): left out of the palm's fit where enough others are known."""


@dataclass(frozen=True, eq=False)
class HandTrack:
    """Positions of a hand's joints at K times.

    Attributes:
        side: ``left`` or ``right``; None if the file does not state it.
        times: Times [s], increasing, shape (K,).
        points: Joint, such as ``index.base`` → its positions in any unit, shape (K, 3).
        moves: Whether the hand's position and orientation are meaningful, or only its fingers.
        may_be_mirrored: Whether the positions may be a mirror image, as those of a selfie camera are.
        labels: The file's name of each time, for messages; empty for ``frame 0`` and so on.
    """

    side: str | None
    times: NDArray[np.float64]
    points: dict[str, NDArray[np.float64]]
    moves: bool = True
    may_be_mirrored: bool = False
    labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, place in self.points.items():
            far = np.abs(place).max(axis=1) > _FARTHEST
            if far.any():
                raise InputError(f"'{name}' lies absurdly far away at {self._label(int(far.argmax()))}")

    def _label(self, time: int) -> str:
        return self.labels[time] if self.labels else f"frame {time}"

    @cached_property
    def bends(self) -> NDArray[np.float64]:
        """Bends [rad] of the finger joints for a right hand, shape (K, 4, 3), see ``finger_bends``."""
        starts = range(0, max(len(self.times), 1), BLOCK)
        return np.concatenate([finger_bends(self[start : start + BLOCK].points) for start in starts])

    @property
    def leaning(self) -> str | None:
        """Probable side of a hand whose bends are not conclusive."""
        return leaning(self.points, self.bends)

    def called(self, side: str) -> HandTrack:
        """The same positions, taken as those of a hand of this side."""
        return replace(self, side=side)

    def mirrored(self) -> HandTrack:
        """The mirror image: the other hand with the same motion."""
        points = {name: place * np.array([-1.0, 1.0, 1.0]) for name, place in self.points.items()}
        return replace(self, side="right" if self.side == "left" else "left", points=points)

    def turns(self, skeleton: Skeleton) -> HandTurns:
        """Rotations of the joints of a rig's hand of the same side.

        The palms are aligned by the least-squares rotation of wrist, metacarpals and finger bases. Then every phalanx
        is rotated in its parent's frame by the minimal rotation to the tracked direction, without twist about itself,
        so that knuckles keep their flexion axes. Bone lengths are the rig's. If the recording has metacarpals, those of
        ring and pinky flex within their limits; index and middle are fixed to the wrist.

        Raises:
            InputError: The track has fewer than four joints of the palm, or these are collinear.
        """
        own = hand_joints(skeleton, self.side)
        palm = [name for name in _PALM if name in own and name in self.points]
        if len(palm) < 4:
            raise InputError(f"the recording has {len(palm)} joints of the palm; 4 are needed to see how the hand lies")
        fixed = [name for name in palm if name not in _MOBILE]
        palm = fixed if len(fixed) > 4 else palm
        rest = skeleton.rest[[own[name] for name in palm]]
        scale = self._scale(palm, rest)
        start = self._places(palm, slice(0, 1))
        back, centre = conjugate(_fit(rest, start)[0]), rest.mean(axis=0)

        def part(times: slice) -> HandPart:
            some, places = self[times], self._places(palm, times)
            palm_turn = _fit(rest, places)
            local = np.tile(IDENTITY, (len(some.times), len(skeleton), 1))
            for digit in DIGITS:
                _drive_digit(digit, some, skeleton, own, conjugate(palm_turn), local)
            moved = rotate(back, places.mean(axis=1) - start[0].mean(axis=0)) / scale
            return HandPart(local, *root_carried(skeleton, multiply(back, palm_turn), centre, moved))

        return HandTurns(tuple(own.values()), self.moves, part)

    def __getitem__(self, times: slice) -> HandTrack:
        points = {name: place[times] for name, place in self.points.items()}
        return replace(self, times=self.times[times], points=points, labels=self.labels[times])

    def _places(self, palm: list[str], times: slice) -> NDArray[np.float64]:
        """Positions of the palm's P joints at k times, shape (k, P, 3)."""
        return np.stack([self.points[name][times] for name in palm], axis=1)

    def _scale(self, palm: list[str], rest: NDArray[np.float64]) -> float:
        """Size of the palm, on average over all times, relative to rest; InputError if the breadth is 0."""
        sizes = []
        for first in range(0, len(self.times), BLOCK):
            places = self._places(palm, slice(first, first + BLOCK))
            apart = places - places.mean(axis=1, keepdims=True)
            spans = np.linalg.svd(apart, compute_uv=False)
            thin = spans[:, 1] <= _THIN * spans[:, 0]
            if thin.any():
                where = self._label(first + int(thin.argmax()))
                raise InputError(f"the joints of the palm lie in a line or a point at {where}")
            sizes.append(np.linalg.norm(apart, axis=(1, 2)))
        return float(np.concatenate(sizes).mean() / np.linalg.norm(rest - rest.mean(axis=0)))


def _fit(rest: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least-squares rotations of the rest points onto the recorded positions (Kabsch)."""
    a = rest - rest.mean(axis=0)
    b = places - places.mean(axis=1, keepdims=True)
    u, _, vt = np.linalg.svd(np.einsum("fpi,pj->fij", b, a))
    proper = np.ones(u.shape[:2])
    proper[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return np.asarray(transform.Rotation.from_matrix((u * proper[:, None, :]) @ vt).as_quat())


def _drive_digit(
    digit: str,
    track: HandTrack,
    skeleton: Skeleton,
    own: dict[str, int],
    to_rest: NDArray[np.float64],
    local: NDArray[np.float64],
) -> None:
    """Set the local rotations of one digit, from the wrist outwards, in ``local``."""
    turned = np.tile(IDENTITY, (len(track.times), 1))
    for joint, following in _pairs(digit):
        if not {joint, following} <= own.keys() or not {joint, following} <= track.points.keys():
            continue
        j = own[joint]
        bone = skeleton.rest[own[following]] - skeleton.rest[j]
        tracked = rotate(to_rest, track.points[following] - track.points[joint])
        lengths = np.linalg.norm(tracked, axis=-1)
        wanted = np.where(lengths[:, None] > 0.0, rotate(conjugate(turned), tracked), bone)
        if joint.endswith("carpometacarpal"):
            local[:, j] = _flex(skeleton, j, bone, wanted)
        else:
            local[:, j] = minimal_rotation(bone, wanted)
        turned = multiply(turned, local[:, j])


def _pairs(digit: str) -> list[tuple[str, str]]:
    joints = [f"{digit}.{joint}" for joint in (*(() if digit == "thumb" else ("carpometacarpal",)), *FINGER_JOINTS)]
    return list(pairwise(joints))


def _flex(
    skeleton: Skeleton, joint: int, bone: NDArray[np.float64], wanted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rotation about the flexion axis, within the limits, that brings a bone closest to the wanted direction."""
    axis = skeleton.axes[joint]
    a, b = bone - axis * (axis @ bone), wanted - np.outer(wanted @ axis, axis)
    limits = skeleton.limits[joint, 0] - skeleton.initial[joint, 0]  # relative to the rest pose, as the angle is
    angle = np.arctan2(np.cross(a, b) @ axis, b @ a).clip(*limits)
    return np.concatenate([np.sin(angle / 2.0)[:, None] * axis, np.cos(angle / 2.0)[:, None]], axis=-1)
