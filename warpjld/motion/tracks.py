"""Key-framed motions: tracks of keys per channel, and sampling them as poses (R2–R5)."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.motion.channels import ROOT_CHANNELS, canonical_channels, resolve_channel
from warpjld.motion.frame_times import frame_times
from warpjld.motion.spline import Spline
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles

__all__ = ["Clamped", "Key", "Limits", "Motion", "Track"]

Limits = Literal["error", "clamp", "ignore"]
"""Treatment of angles beyond their joint's limits."""

_ROUNDING = 1e-9
"""Excess over a limit [rad] that is ignored: conversion between degrees and radians is not exact."""


@dataclass(frozen=True)
class Key:
    """A key value [rad or m] at a frame, with its Kochanek–Bartels constants."""

    frame: float
    value: float
    tension: float = 0.0
    continuity: float = 0.0
    bias: float = 0.0


class Track:
    """The keys of one channel; they may be set in any order.

    They are kept as columns of numbers: as objects, the keys of a long table would need most of the memory.
    """

    def __init__(self, channel: str) -> None:
        self.channel = channel
        self._frames, self._values = array("d"), array("d")  # by increasing frame
        self._constants: dict[float, tuple[float, float, float]] = {}  # by frame, where they are not all zero
        self._made: list[Spline] = []  # the spline through these keys, once it was asked for

    def __deepcopy__(self, memo: dict[int, object]) -> Track:
        """A track of its own. The spline through the keys is made once for both."""
        other = memo[id(self)] = Track(self.channel)
        other._frames, other._values, other._constants = self._frames[:], self._values[:], dict(self._constants)
        other._made = self._made
        return other

    def set(self, key: Key) -> None:
        """Add a key, or replace the one at its frame."""
        at = self._at(key.frame)
        if self._frames[at : at + 1] == array("d", [key.frame]):
            self._values[at] = key.value
        else:
            self._frames.insert(at, key.frame)
            self._values.insert(at, key.value)
        constants = key.tension, key.continuity, key.bias
        self._constants.pop(key.frame, None)
        if any(constants):
            self._constants[key.frame] = constants
        self._made = []

    def remove(self, frame: float) -> None:
        """Forget the key at a frame, if there is one."""
        at = self._at(frame)
        if self._frames[at : at + 1] == array("d", [frame]):
            del self._frames[at], self._values[at]
            self._constants.pop(frame, None)
        self._made = []

    def _at(self, frame: float) -> int:
        """Index of the first key that is not before a frame."""
        last = len(self._frames) - 1
        return last + 1 if last < 0 or self._frames[last] < frame else bisect_left(self._frames, frame)

    @property
    def keys(self) -> tuple[Key, ...]:
        """The keys, by increasing frame."""
        rows = zip(self._frames, self._values, strict=True)
        return tuple(Key(frame, value, *self._constants.get(frame, ())) for frame, value in rows)

    @property
    def frames(self) -> tuple[float, ...]:
        """Frames of the keys, increasing."""
        return tuple(self._frames)

    @property
    def spline(self) -> Spline:
        """The spline through the keys."""
        if not self._made:
            frames, values = np.array(self._frames), np.array(self._values)
            constants: tuple[ArrayLike, ...] = ()
            if self._constants:
                plain = (0.0, 0.0, 0.0)
                constants = tuple(np.array([self._constants.get(frame, plain) for frame in self._frames]).T)
            self._made.append(Spline(frames, values, *constants))
        return self._made[0]


@dataclass(frozen=True)
class Clamped:
    """Interpolated values of a channel that exceeded a limit and were held at it.

    Attributes:
        channel: ``joint.channel`` with the joint's full name.
        frames: First and last frame with such values.
        worst: The most excessive value [rad].
        limit: The limit [rad].
    """

    channel: str
    frames: tuple[float, float]
    worst: float
    limit: float

    def __str__(self) -> str:
        first, last = self.frames
        return (
            f"{self.channel}: interpolated values from frame {first:g} to {last:g} reach {np.degrees(self.worst):.4g}"
            f"°; held at the limit of {np.degrees(self.limit):.4g}°"
        )


@dataclass(eq=False)
class Motion:
    """Tracks, a frame rate, and default constants of keys.

    Attributes:
        rate: Frames a second.
        tension: Default tension; likewise ``continuity`` and ``bias``.
        span: First and last frame; None for those of the keys.
        tracks: Tracks by channel.

    Examples:
        >>> motion = wj.Motion(rate=30)
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 20, 1.2)  # rad
        >>> motion
        Motion(1 track, frames 0 to 20 at 30 a second)
        >>> float(motion.value("index.base.flexion", 10))
        0.6
    """

    rate: float = 30.0
    tension: float = 0.0
    continuity: float = 0.0
    bias: float = 0.0
    span: tuple[float, float] | None = None
    tracks: dict[str, Track] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rate) and self.rate > 0.0):
            raise InputError(f"rate: want frames a second, above 0, got {self.rate:g}")

    def __repr__(self) -> str:
        first, last = self.frame_range
        count = len(self.tracks)
        return f"Motion({count} track{'s' * (count != 1)}, frames {first:g} to {last:g} at {self.rate:g} a second)"

    def set_key(
        self,
        channel: str,
        frame: float,
        value: float,
        *,
        tension: float | None = None,
        continuity: float | None = None,
        bias: float | None = None,
    ) -> None:
        """Set a key, or replace the one at its frame.

        Args:
            channel: ``joint.channel`` or ``root.x|y|z``, or an alias: ``metacarpus.flexion``, ``joint 14.flexion``.
            frame: Frame number.
            value: Angle [rad], or displacement of the root [m].
            tension: The key's own constant instead of the motion's; likewise ``continuity`` and ``bias``.

        Raises:
            InputError: Unknown channel, or a number that is not finite.
        """
        if not (np.isfinite(frame) and np.isfinite(value)):
            raise InputError(f"key of '{channel}': frame and value must be finite, got {frame:g} and {value:g}")
        key = Key(
            float(frame),
            float(value),
            self.tension if tension is None else tension,
            self.continuity if continuity is None else continuity,
            self.bias if bias is None else bias,
        )
        for name in canonical_channels(channel):
            self.tracks.setdefault(name, Track(name)).set(key)

    def value(self, channel: str, frame: ArrayLike, initial: float = 0.0) -> NDArray[np.float64]:
        """Values [rad or m] at any frame, between keys, too (R4), in the shape of ``frame``; ``initial`` for a channel
        without keys.

        The side may be left out where only one side has keys.
        """
        name = canonical_channels(channel)[0]
        sided = [n for n in self.tracks if n in (f"left.{name}", f"right.{name}")]
        if name not in self.tracks and len(sided) == 1:
            name = sided[0]
        track = self.tracks.get(name)
        return np.full(np.shape(frame), initial) if track is None else track.spline(frame)

    @property
    def frame_range(self) -> tuple[float, float]:
        """First and last frame; (0, 0) without keys."""
        if self.span is not None:
            return self.span
        keyed = [frames for track in self.tracks.values() if (frames := track.frames)]
        return (min(one[0] for one in keyed), max(one[-1] for one in keyed)) if keyed else (0.0, 0.0)

    @property
    def frames(self) -> NDArray[np.float64]:
        """All frames from first to last, with a step of 1, shape (F,)."""
        first, last = self.frame_range
        return frame_times(first, last, 1.0)

    def sample(
        self, frames: ArrayLike, skeleton: Skeleton, *, limits: Limits = "error"
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles [rad], shape (F, J, 4), and displacements of the root [m], shape (F, 3), at F frames.

        Interpolated values that exceed a limit are held at it, unless limits are ignored; see ``clamped``.

        Args:
            frames: Frame numbers, whole or not, shape (F,).
            skeleton: Skeleton with the joints and limits.
            limits: Keys beyond a limit: ``error`` rejects them, ``clamp`` holds them at it, ``ignore`` uses them.

        Raises:
            InputError: A joint the skeleton does not have, two tracks of one channel, or a key beyond its limit.
        """
        angles, root = self._raw(frames, skeleton)
        if limits == "ignore":
            return angles, root
        if limits == "error":
            self._check_keys(skeleton)
        for joint, channel in self._places(skeleton).values():
            angles[:, joint, channel].clip(*skeleton.limits[joint, channel], out=angles[:, joint, channel])
        return angles, root

    def clamped(self, frames: ArrayLike, skeleton: Skeleton) -> tuple[Clamped, ...]:
        """Values that ``sample`` holds at a limit over these frames, by channel."""
        at = np.atleast_1d(np.asarray(frames, dtype=np.float64))
        found = []
        for track, (joint, channel) in self._places(skeleton).items():
            values = self.tracks[track].spline(at)
            low, high = skeleton.limits[joint, channel]
            for limit, beyond in ((low, low - values), (high, values - high)):
                if len(where := np.flatnonzero(beyond > _ROUNDING)):
                    name = f"{skeleton.names[joint]}.{CHANNELS[channel]}"
                    worst = float(values[np.argmax(beyond)])
                    found.append(Clamped(name, (float(at[where[0]]), float(at[where[-1]])), worst, float(limit)))
        return tuple(found)

    def poses(self, skeleton: Skeleton, frames: ArrayLike | None = None, *, limits: Limits = "error") -> Poses:
        """Poses at the given frames, or at all; see ``sample``."""

        angles, root = self.sample(self.frames if frames is None else frames, skeleton, limits=limits)
        return poses_from_angles(skeleton, angles, root_position=root)

    def _raw(self, frames: ArrayLike, skeleton: Skeleton) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        at = np.atleast_1d(np.asarray(frames, dtype=np.float64))
        if at.ndim != 1 or not np.isfinite(at).all():
            raise InputError(f"frames: want finite numbers, shape (n,), got shape {at.shape}")
        angles = np.repeat(skeleton.initial[None], len(at), axis=0)
        for name, (joint, channel) in self._places(skeleton).items():
            angles[:, joint, channel] = self.tracks[name].spline(at)
        root = np.stack([self.value(name, at) for name in ROOT_CHANNELS], axis=-1)
        return angles, root

    def _places(self, skeleton: Skeleton) -> Mapping[str, tuple[int, int]]:
        places: dict[str, tuple[int, int]] = {}
        owners: dict[tuple[int, int], str] = {}
        for name in self.tracks:
            if name in ROOT_CHANNELS:
                continue
            place = resolve_channel(name, skeleton)
            if place in owners:
                raise InputError(f"'{owners[place]}' and '{name}' are the same channel of this skeleton: use one name")
            owners[place] = name
            places[name] = place
        return places

    def _check_keys(self, skeleton: Skeleton) -> None:
        for name, (joint, channel) in self._places(skeleton).items():
            low, high = skeleton.limits[joint, channel]
            keys = self.tracks[name].spline
            within = (low - _ROUNDING <= keys.values) & (keys.values <= high + _ROUNDING)
            if not within.all():
                value, frame = keys.values[np.argmin(within)], keys.times[np.argmin(within)]
                side, limit = ("below", low) if value < low else ("above", high)
                raise InputError(
                    f"{skeleton.names[joint]}: {CHANNELS[channel]} {np.degrees(value):.6g}° at frame "
                    f"{frame:g} is {side} its limit of {np.degrees(limit):.6g}°"
                )
