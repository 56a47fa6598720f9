"""Reader of WebXR hand poses: named poses of 25 joints, each a 4 × 4 matrix in metres, stored by columns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.hand_track import HandTrack
from warpjld.skeleton import DIGITS

__all__ = ["WEBXR_JOINTS", "is_webxr", "webxr_hands"]

WEBXR_JOINTS = {"wrist": "wrist"} | {
    f"{name}-{part}": f"{digit}.{joint}"
    for digit in DIGITS
    for name, parts in (
        ("thumb", ("metacarpal", "phalanx-proximal", "phalanx-distal", "tip"))
        if digit == "thumb"
        else (
            f"{digit}-finger",
            ("metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip"),
        ),
    )
    for part, joint in zip(
        parts,
        ("base", "knuckle2", "knuckle3", "tip")
        if digit == "thumb"
        else ("carpometacarpal", "base", "knuckle2", "knuckle3", "tip"),
        strict=True,
    )
}
"""WebXR Hand Input joint → canonical joint without the side."""


def is_webxr(content: Any) -> bool:
    """Whether JSON content holds poses of WebXR joints: a ``wrist``, at most two levels below the top."""
    return isinstance(content, Mapping) and any(True for _ in _poses(content))


def webxr_hands(content: Mapping[str, Any]) -> HandRecording:
    """Poses in the file's order, at a rate of one a second.

    The format does not store the side. It is taken from a ``handedness`` field beside or inside the poses, from keys
    ``left`` and ``right`` above or inside the poses, or from the poses' names (``left fist``, ``fist_L``) if all state
    it; otherwise it is unknown. Poses are relative to a controller's grip, so only the fingers are used.

    Raises:
        InputError: A joint is missing or its matrix is invalid, with its name; or contradictory sides.
    """
    stated = _side(content.get("handedness"), "the file")
    found: dict[str | None, dict[str, NDArray[np.float64]]] = {}
    for name, above, pose in _poses(content):
        side = above or _side(pose.get("handedness"), f"pose '{name}'") or stated
        found.setdefault(side, {})[name] = _places(name, pose)
    if set(found) == {None}:
        named = {name: _named_side(name) for name in found[None]}
        if None not in named.values():
            found = {s: {n: p for n, p in found[None].items() if named[n] == s} for s in dict.fromkeys(named.values())}
    if None in found and len(found) > 1:
        raise InputError(f"pose '{next(iter(found[None]))}' does not state its hand, but others do")
    return HandRecording(tuple(_track(side, poses) for side, poses in found.items()), 1.0)


def _poses(content: Mapping[str, Any]) -> Iterator[tuple[str, str | None, Mapping[str, Any]]]:
    """Name of every pose, its side if a key states it, and its joints."""
    for name, entry in content.items():
        if not isinstance(entry, Mapping):
            continue
        side = _SIDES.get(name.lower())
        if "wrist" in entry:
            yield name, side, entry
            continue
        for inner, pose in entry.items():
            if isinstance(pose, Mapping) and "wrist" in pose:
                own = _SIDES.get(inner.lower())
                yield inner if side else name if own else f"{name} {inner}", side or own, pose


_SIDES = {"left": "left", "right": "right"}
_IN_NAME = re.compile(r"(?:^|[\s._-])(left|right|l|r)(?=$|[\s._-])", re.IGNORECASE)


def _named_side(name: str) -> str | None:
    found = {match[0].lower() for match in _IN_NAME.findall(name)}
    return {"l": "left", "r": "right"}.get(found.pop()) if len(found) == 1 else None


def _side(stated: Any, where: str) -> str | None:
    if stated is None or stated in ("", "none"):  # "none" is WebXR's value for an unknown side
        return None
    side = _SIDES.get(str(stated).lower())
    if side is None:
        raise InputError(f"handedness of {where}: want left or right, got '{stated}'")
    return side


def _track(side: str | None, poses: Mapping[str, NDArray[np.float64]]) -> HandTrack:
    places = np.array(list(poses.values()))
    points = {joint: places[:, k] for k, joint in enumerate(WEBXR_JOINTS.values())}
    times = np.arange(len(places), dtype=np.float64)
    return HandTrack(side, times, points, moves=False, labels=tuple(f"pose '{name}'" for name in poses))


def _places(name: str, pose: Mapping[str, Any]) -> NDArray[np.float64]:
    """Positions of a pose's joints, shape (25, 3)."""
    return np.array([_place(name, pose, joint) for joint in WEBXR_JOINTS])


def _place(pose_name: str, pose: Mapping[str, Any], joint: str) -> NDArray[np.float64]:
    try:
        matrix = np.array(pose[joint]["offsetMatrix"], dtype=np.float64)
    except KeyError as error:
        raise InputError(f"pose '{pose_name}': no '{joint}' with an 'offsetMatrix'") from error
    except (TypeError, ValueError) as error:
        raise InputError(f"pose '{pose_name}': the offsetMatrix of '{joint}' is not 16 numbers") from error
    if matrix.shape != (16,) or not np.isfinite(matrix).all():
        raise InputError(f"pose '{pose_name}': the offsetMatrix of '{joint}' is not 16 finite numbers")
    return matrix[12:15]
