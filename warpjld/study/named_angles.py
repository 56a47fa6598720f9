"""Joint angles by name, such as ``index.base.flexion``, for files of grasps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.skeleton import CHANNELS, Skeleton
from warpjld.suggest import did_you_mean

__all__ = ["angles_by_name", "beyond_limits", "channel_names", "channel_of", "free_channels"]

_MOST = 2.0 * np.pi  # largest magnitude of an angle; larger ones are probably in degrees [rad]


def channel_names(skeleton: Skeleton, chosen: NDArray[np.bool_]) -> list[str]:
    """Names of the channels in a mask (J, 4), joint by joint, such as ``left.index.base.flexion``."""
    return [f"{skeleton.names[j]}.{CHANNELS[k]}" for j, k in np.argwhere(chosen).tolist()]


def free_channels(skeleton: Skeleton, angles: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Channels needed to describe postures: those that can move, and those that differ from rest in any posture.

    Args:
        skeleton: The skeleton.
        angles: Joint angles [rad], shape (G, J, 4).

    Returns:
        Mask of the channels, shape (J, 4).
    """
    room = skeleton.limits[..., 1] > skeleton.limits[..., 0]
    return np.asarray(room | (angles != skeleton.initial).any(axis=0))


def channel_of(skeleton: Skeleton, name: str) -> tuple[int, int] | None:
    """Indices of joint and channel by name, side optional; None if this skeleton has no such joint or channel."""
    joint, _, channel = name.rpartition(".")
    if channel not in CHANNELS:
        return None
    try:
        return skeleton.index(joint), CHANNELS.index(channel)
    except InputError:
        return None


def angles_by_name(skeleton: Skeleton, values: Mapping[str, float]) -> NDArray[np.float64]:
    """Joint angles [rad], shape (J, 4), from angles by name; channels not named keep their rest angles.

    Raises:
        InputError: A name that is no channel of this hand, an angle given twice, or a number that is no angle.
    """
    _check_names(skeleton, values)
    angles, seen = skeleton.initial.copy(), dict[tuple[int, int], str]()
    for name, value in values.items():
        place = channel_of(skeleton, name)
        assert place is not None
        if place in seen:
            raise InputError(f"'{seen[place]}' and '{name}' are the same joint's angle")
        if not np.isfinite(value) or abs(value) > _MOST:
            raise InputError(f"'{name}': {value:.6g} is no angle in radians (degrees?)")
        seen[place], angles[place] = name, value
    return angles


def beyond_limits(skeleton: Skeleton, angles: NDArray[np.float64]) -> int:
    """Number of angles (J, 4) [rad] that are more than one degree beyond their limits."""
    slack = np.radians(1.0)
    low, high = skeleton.limits[..., 0] - slack, skeleton.limits[..., 1] + slack
    return int(((angles < low) | (angles > high)).sum())


def _check_names(skeleton: Skeleton, names: Iterable[str]) -> None:
    strange = [name for name in names if channel_of(skeleton, name) is None]
    if not strange:
        return
    known = [f"{joint.partition('.')[2] or joint}.{channel}" for joint in skeleton.names for channel in CHANNELS]
    few = ", ".join(f"'{name}'" for name in strange[:3]) + (", …" if len(strange) > 3 else "")
    raise InputError(
        f"{few}: no joint of this hand{did_you_mean(strange[0], known)}; its angles are called index.base.flexion and "
        "so on. Joints with other names, such as a robot's, need a joint map that says which angle each of them is"
    )
