"""JSON recordings of hands: read, and told apart."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.motion.hand_track import HandTrack
from warpjld.motion.leap import leap_track
from warpjld.motion.webxr import webxr_track

__all__ = ["read_hand_track"]


def read_hand_track(path: str | Path) -> tuple[HandTrack, float]:
    """Read a recording of one hand: WebXR poses or frames of a Leap Motion Controller.

    Returns:
        The recording, and the frames a second it was made at.

    Raises:
        InputError: Unreadable, not JSON, or neither of the two.
    """
    try:
        content: Any = json.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot read motion: {error.strerror}", path=path) from error
    except UnicodeDecodeError as error:
        raise InputError("not a text file in UTF-8", path=path) from error
    except json.JSONDecodeError as error:
        raise InputError(f"not JSON: {error.msg}", path=path, line=error.lineno, column=error.colno) from error
    try:
        if isinstance(content, dict) and isinstance(content.get("frames"), list):
            return leap_track(content)
        if isinstance(content, dict) and any(isinstance(v, dict) and "wrist" in v for v in content.values()):
            return webxr_track(content)
    except InputError as error:
        raise InputError(error.message, path=path) from error
    raise InputError(
        "neither WebXR hand poses nor a Leap Motion recording: no 'frames', no pose with a 'wrist'", path=path
    )
