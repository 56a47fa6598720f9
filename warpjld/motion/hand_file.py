"""Reader of hand recordings in JSON and NumPy files; the format is detected from the content."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.array_file import read_arrays
from warpjld.files.input_file import open_input
from warpjld.files.json_pieces import json_pieces
from warpjld.files.reading import reading
from warpjld.files.text_file import read_json
from warpjld.limits import limit
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.leap import is_leap, leap_hands
from warpjld.motion.mano import is_mano, mano_hands
from warpjld.motion.mediapipe import is_mediapipe, mediapipe_arrays, mediapipe_hands
from warpjld.motion.webxr import is_webxr, webxr_hands

__all__ = ["read_hands"]


def read_hands(path: str | Path, *, rate: float | None = None, flat_hand_mean: bool | None = None) -> HandRecording:
    """Read a recording of one or two hands: WebXR poses, Leap Motion frames, MediaPipe landmarks or MANO parameters.

    Args:
        path: A ``.json`` or ``.jsonl`` (a frame a line), ``.npz`` or ``.npy`` file.
        rate: Frames a second if the file does not state it; 30 by default.
        flat_hand_mean: Whether zero rotations of MANO mean the flat hand, if the file does not state it.

    Raises:
        InputError: Unreadable, or none of these formats.
    """
    path = Path(path)
    with _content(path) as content, reading(path, "a recording of hands"):
        if path.suffix.lower() in (".npz", ".npy"):
            if is_mediapipe(content) or ("" in content and content[""].shape[-2:] == (21, 3)):
                return mediapipe_arrays(content, rate)
            if is_mano(content):
                return mano_hands(content, rate, flat_hand_mean)
            held = ", ".join(f"'{name}' {array.shape}" for name, array in content.items()) or "nothing"
            raise InputError(f"neither hand landmarks (F, 21, 3) nor MANO parameters (hand_pose, …): holds {held}")
        if is_leap(content):
            return leap_hands(content)
        if is_webxr(content):
            return webxr_hands(content)
        if is_mediapipe(content):
            return mediapipe_hands(content, rate)
        if is_mano(content):
            return mano_hands(content, rate, flat_hand_mean)
    raise InputError(
        "no hand recording: neither WebXR poses (a 'wrist'), Leap Motion frames ('pointables'), 21 MediaPipe landmarks "
        "nor MANO parameters ('hand_pose')",
        path=path,
    )


@contextmanager
def _content(path: Path) -> Iterator[Any]:
    """Arrays by name, or what a JSON file holds; a large one is decoded frame by frame, as it is needed."""
    suffix = path.suffix.lower()
    if suffix in (".npz", ".npy"):
        yield read_arrays(path)
        return
    with open_input(path) as file:
        size = os.fstat(file.fileno()).st_size
    if suffix == ".jsonl" or size > limit("json-bytes"):
        with json_pieces(path, lines=suffix == ".jsonl") as content:
            yield content
    else:
        yield read_json(path)
