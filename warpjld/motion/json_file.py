"""JSON recordings of hands: read, and told apart."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.motion.hand_track import HandTrack
from warpjld.motion.leap import leap_track
from warpjld.motion.webxr import webxr_track
from warpjld.text_file import read_json

__all__ = ["read_hand_track"]


def read_hand_track(path: str | Path) -> tuple[HandTrack, float]:
    """Read a recording of one hand: WebXR poses or frames of a Leap Motion Controller.

    Returns:
        The recording, and the frames a second it was made at.

    Raises:
        InputError: Unreadable, not JSON, or neither of the two.
    """
    content = read_json(path)
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
