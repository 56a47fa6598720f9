"""Hands stored under keys of their side in a frame, as by MediaPipe's holistic landmarker."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

__all__ = ["hands_by_side"]

_KEY = re.compile(r"(left|right)(hand)?(world)?(landmarks)?")
_COUNT = 21  # landmarks of one hand: the wrist, and four per digit


def hands_by_side(frame: Any) -> list[dict[str, Any]] | None:
    """Hands of a frame such as ``{"left_hand_landmarks": […], "rightHandLandmarks": null}``.

    World landmarks are preferred. A list of one hand inside a list, as MediaPipe Tasks write it, is accepted.

    Returns:
        ``landmarks`` or ``world_landmarks``, and ``handedness``, of each visible hand; None where the frame has no such
        keys, or these hold something else.
    """
    if not isinstance(frame, Mapping):
        return None
    found: dict[str, dict[str, Any]] = {}
    keys = [(m, value) for key, value in frame.items() if (m := _KEY.fullmatch(re.sub(r"[\s_-]", "", key.lower())))]
    for match, value in sorted(keys, key=lambda pair: pair[0][3] or ""):
        points = value.get("landmark", value.get("landmarks")) if isinstance(value, Mapping) else value
        if isinstance(points, list) and len(points) == 1:
            points = points[0]
        if not points:
            continue
        if not (isinstance(points, list) and len(points) == _COUNT):
            return None
        key = "world_landmarks" if match[3] else "landmarks"
        found[match[1]] = {key: points, "handedness": match[1]}
    return list(found.values()) if keys else None
