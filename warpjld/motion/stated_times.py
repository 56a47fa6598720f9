"""Frame times as scripts and libraries write them: timestamps in some unit, a rate, or neither."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.json_pieces import JSON_LISTS

__all__ = ["DEFAULT_RATE", "stated_times", "time_fields"]

DEFAULT_RATE = 30.0  # frames a second; its use is noted

_RATES = ("fps", "rate", "frame_rate", "framerate", "frameRate", "mocap_framerate", "mocap_frame_rate")
_UNITS = {"_ms": 1e-3, "Ms": 1e-3, "_us": 1e-6, "_ns": 1e-9, "_s": 1.0, "_sec": 1.0}
_STAMPS = tuple(f"{stem}{unit}" for stem in ("timestamp", "timestamps", "time", "times") for unit in ("", *_UNITS))


def stated_times(
    about: Mapping[str, Any], frames: Sequence[Mapping[str, Any]], rate: float | None, notes: list[str]
) -> tuple[NDArray[np.float64], float]:
    """Times [s] of all frames since the first, shape (F,), and frames a second.

    Timestamps whose names do not state a unit are in seconds, milliseconds or microseconds, by their typical step: less
    than 2, less than 2000, or more.

    Args:
        about: Fields of the file for all frames.
        frames: Fields of each frame.
        rate: Frames a second if the file states nothing; None for 30, with a note.
        notes: Notes on assumptions are appended.

    Raises:
        InputError: Timestamps that do not increase, or a rate that is not positive.
    """
    count = len(frames)
    stamps, unit = _stamps(about, frames)
    if stamps is not None and count > 1:
        steps = np.diff(stamps)
        if not (np.isfinite(stamps).all() and (steps > 0.0).all()):
            bad = int(np.argmin(np.nan_to_num(steps, nan=-1.0, posinf=-1.0))) + 1
            raise InputError(f"frame {bad}: its timestamp is not a time after the one before")
        if unit is None:
            step = float(np.median(steps))
            unit, name = (
                (1.0, "seconds") if step < 2.0 else (1e-3, "milliseconds") if step < 2e3 else (1e-6, "microseconds")
            )
            notes.append(f"timestamps {step:.4g} apart are read as {name}")
        times = (stamps - stamps[0]) * unit
        return times, round((count - 1) / float(times[-1]), 1) or float(1.0 / times[-1])
    stated = next((about[key] for key in _RATES if key in about), None)
    if stated is not None:
        value = _number(stated)
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"want frames a second, above 0, got {stated}")
        return np.arange(count) / value, value
    if rate is None and count > 1:
        notes.append(f"the file does not state its rate: assumed {DEFAULT_RATE:g} frames a second (--rate to change)")
    value = DEFAULT_RATE if rate is None else rate
    return np.arange(count) / value, value


def time_fields(frame: Any) -> dict[str, Any]:
    """Those fields of a frame that ``stated_times`` reads; none where it is no object."""
    return {key: frame[key] for key in _STAMPS if key in frame} if isinstance(frame, Mapping) else {}


def _stamps(
    about: Mapping[str, Any], frames: Sequence[Mapping[str, Any]]
) -> tuple[NDArray[np.float64] | None, float | None]:
    """The timestamps in the file's unit, and that unit [s] if their name states it.

    Those of frames without one (where nothing was detected, for example) are interpolated or extrapolated.
    """
    for key in _STAMPS:
        values = about.get(key)
        if not isinstance(values, JSON_LISTS):
            values = [frame.get(key) for frame in frames]
        values = list(values)
        where = [k for k, value in enumerate(values) if value is not None]
        if len(values) != len(frames) or len(where) < min(2, len(frames)):
            continue
        try:
            known = np.array([float(values[k]) for k in where])
        except (TypeError, ValueError):
            raise InputError(f"'{key}': want numbers") from None
        at = np.arange(len(frames), dtype=np.float64)
        array = np.interp(at, where, known)
        step = float(np.median(np.diff(known) / np.diff(where))) if len(where) > 1 else 0.0
        array += step * (np.minimum(at - where[0], 0.0) + np.maximum(at - where[-1], 0.0))
        return array, next((unit for end, unit in _UNITS.items() if key.endswith(end)), None)
    return None, None


def _number(value: Any) -> float:
    try:
        return float(np.asarray(value, dtype=np.float64).reshape(-1)[0])
    except (IndexError, TypeError, ValueError):
        return math.nan
