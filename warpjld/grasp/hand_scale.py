"""Plausibility of an object's size beside a hand: finds files that were read in the wrong unit."""

from __future__ import annotations

from collections.abc import Callable

from warpjld.grasp.object_file import UNITS
from warpjld.grasp.objects import GraspObject
from warpjld.skeleton import Skeleton

__all__ = ["doubt_of_size", "hand_length"]

_LARGER, _SMALLER = 20.0, 1.0 / 50.0  # largest and smallest plausible ratio of the object's longest side to the hand
_USUAL = 0.19  # length of an adult hand, taken where there is no hand to measure [m]


def hand_length(skeleton: Skeleton) -> float | None:
    """Distance at rest from wrist to tip of the middle finger [m], of the longer hand; None without a hand."""
    found = [
        float(((skeleton.rest[skeleton.index(wrist)] - skeleton.rest[skeleton.index(tip)]) ** 2).sum() ** 0.5)
        for wrist, tip in ((f"{side}.wrist", f"{side}.middle.tip") for side in ("left", "right"))
        if wrist in skeleton.names and tip in skeleton.names
    ]
    return max(found, default=None)


def doubt_of_size(
    thing: GraspObject, hand: float | None, unit: str | None, say_unit: Callable[[str], str] = "UNIT {}".format
) -> str | None:
    """Message about an implausible size, with the units that would make it plausible; None if the size is plausible.

    Args:
        thing: The object as it was read.
        hand: The hand's length [m]; None: 0.19 m.
        unit: Unit that the file was read in, one of ``UNITS``; None where the unit cannot be chosen.
        say_unit: Formats the option that chooses a unit, which it is given in upper case.
    """
    size, length = float(thing.size.max()), _USUAL if hand is None else hand
    if not min(length, size) > 0.0 or _SMALLER * length < size < _LARGER * length:
        return None
    times = f"{size / length:.3g} times" if size > length else f"1/{length / size:.3g} of"
    whose = "a hand's usual" if hand is None else "the hand's"
    others = {other: size * UNITS[other] / UNITS[unit] for other in ("m", "cm", "mm")} if unit else {}
    fitting = {u: s for u, s in others.items() if _SMALLER * length < s < _LARGER * length}
    hints = [f"{say_unit(u.upper())} would make it {s:.3g} m" for u, s in fitting.items()]
    return f"measures {size:.4g} m, {times} {whose} {length:.3g} m: {', '.join(hints) or 'no unit makes it fit a hand'}"
