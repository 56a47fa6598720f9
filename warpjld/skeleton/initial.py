"""Initial angles: joint angles of the rest pose (A §3, R25).

Limits and flexion ratios count from the straight joint. For elbows and knees that are bent in the rest pose (elbows in
most A-poses), the initial flexion is the angle between upper and lower limb. Other joints are not estimated: at rest a
hip or the base of a finger is not straight, and knuckle positions are exact to a few degrees only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.channels import CHANNELS, FLEXION
from warpjld.skeleton.tree import Skeleton

__all__ = ["bent_as_before", "bent_limbs", "check_initial", "with_initial"]

_HINGES = {"elbow": ("shoulder", "wrist"), "knee": ("hip", "ankle")}
_NEGLIGIBLE = np.radians(1.0)
"""Smaller angles are within the accuracy of joint positions and count as straight."""
_ROUNDING = 1e-6  # rad: limits in files are in degrees


def with_initial(skeleton: Skeleton, given: Mapping[int, Mapping[str, float]]) -> tuple[Skeleton, tuple[str, ...]]:
    """A skeleton with initial angles set, and notes for the user. Elbows and knees without a stated angle get the one
    that their joint positions give.

    Args:
        skeleton: With limits.
        given: Stated angles [rad], by joint, then by channel name.

    Raises:
        InputError: A stated angle is beyond its joint's limits.
    """
    initial = np.zeros((len(skeleton), len(CHANNELS)))
    for joint, channels in given.items():
        for channel, angle in channels.items():
            initial[joint, CHANNELS.index(channel)] = angle
    found = {joint: angle for joint, angle in bent_limbs(skeleton).items() if joint not in given}
    limits = skeleton.limits.copy()
    for joint, angle in found.items():
        initial[joint, FLEXION] = angle
        limits[joint, FLEXION, 1] = max(limits[joint, FLEXION, 1], angle)
    if not initial.any():
        return skeleton, ()
    bent = replace(skeleton, initial=initial, limits=limits)
    check_initial(bent)
    names = ", ".join(f"{skeleton.names[joint]} by {np.degrees(angle):.1f}°" for joint, angle in found.items())
    return bent, (f"bent at rest: {names}; angles count from the straight joint",) if found else ()


def bent_limbs(skeleton: Skeleton) -> dict[int, float]:
    """Flexion [rad] of elbows and knees that are bent at rest, by joint: the angle between upper and lower limb about
    the flexion axis."""
    places = {name: joint for joint, name in enumerate(skeleton.names)}
    out = {}
    for name, joint in places.items():
        side, _, part = name.rpartition(".")
        ends = [places[f"{side}.{end}"] for end in _HINGES.get(part, ()) if f"{side}.{end}" in places]
        if len(ends) < 2:
            continue
        before, after = (unit(v) for v in np.diff(skeleton.rest[[ends[0], joint, ends[1]]], axis=0))
        axis = skeleton.axes[joint]
        before, after = (unit(v - axis * (axis @ v)) for v in (before, after))
        angle = float(np.arctan2(np.cross(before, after) @ axis, before @ after))
        if angle > _NEGLIGIBLE:
            out[joint] = angle
    return out


def bent_as_before(before: Skeleton, after: Skeleton) -> Skeleton:
    """``after``, a skeleton whose joints or axes were moved, with updated initial angles: those that followed from the
    joint positions in ``before`` are computed anew, stated ones are kept."""
    old, new = bent_limbs(before), bent_limbs(after)
    initial, limits = after.initial.copy(), after.limits.copy()
    for joint, angle in old.items():
        if before.initial[joint, FLEXION] == angle:
            initial[joint, FLEXION] = new.get(joint, 0.0)
            limits[joint, FLEXION, 1] = max(limits[joint, FLEXION, 1], new.get(joint, 0.0))
    return replace(after, initial=initial, limits=limits)


def check_initial(skeleton: Skeleton) -> None:
    """Raise InputError where an initial angle is beyond its joint's limits."""
    low, high = np.moveaxis(skeleton.limits, -1, 0)
    beyond = (skeleton.initial != 0.0) & ~_within(skeleton.initial, low, high)
    for joint, channel in np.argwhere(beyond).tolist():
        least, most = np.degrees(skeleton.limits[joint, channel])
        angle = np.degrees(skeleton.initial[joint, channel])
        raise InputError(
            f"joint '{skeleton.names[joint]}': initial {CHANNELS[channel]} {angle:g}° is beyond its limits, "
            f"{least:.4g}° to {most:.4g}°"
        )


def _within(angle: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray((angle >= low - _ROUNDING) & (angle <= high + _ROUNDING))
