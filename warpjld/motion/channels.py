"""Channel names: ``joint.channel`` or ``root.x``, with the paper's joint numbers and the metacarpus as aliases."""

from __future__ import annotations

import re

from warpjld.errors import InputError
from warpjld.skeleton import CHANNELS, PAPER_NUMBERS, Skeleton
from warpjld.suggest import one_of

__all__ = ["ROOT_CHANNELS", "canonical_channels", "resolve_channel"]

ROOT_CHANNELS = ("root.x", "root.y", "root.z")
"""Displacement of the root from rest [m]."""

_NUMBER = re.compile(r"joint\s*([0-9]{1,4})")
_METACARPUS = ("ring.carpometacarpal", "pinky.carpometacarpal")


def canonical_channels(channel: str) -> tuple[str, ...]:
    """The channels that a name denotes, in lower case.

    ``joint 14.flexion`` is ``index.knuckle3.flexion`` by the paper's numbers (A Fig. 2); ``metacarpus.flexion`` is
    the flexion of joints 1 and 2, the carpometacarpals of ring and pinky (R8). A side may precede each.

    Raises:
        InputError: Not of the form ``joint.channel``, or no such channel or joint number.
    """
    name = channel.strip().lower()
    if name in ROOT_CHANNELS:
        return (name,)
    joint, dot, kind = name.rpartition(".")
    if not dot or not joint:
        raise InputError(f"channel '{channel}': want 'joint.channel', such as 'index.base.flexion', or 'root.x'")
    if joint == "root" and len(kind) == 1:
        raise InputError(f"channel '{channel}': the root moves along x, y or z")
    if kind not in CHANNELS:
        raise InputError(f"channel '{channel}': no angle '{kind}'{one_of(kind, CHANNELS)}")
    side, dot, rest = joint.partition(".")
    prefix, bare = (f"{side}.", rest) if dot and side in ("left", "right") else ("", joint)
    if bare == "metacarpus":
        if kind != "flexion":
            raise InputError(f"channel '{channel}': the metacarpus has flexion only")
        return tuple(f"{prefix}{metacarpal}.flexion" for metacarpal in _METACARPUS)
    if number := _NUMBER.fullmatch(bare):
        if int(number[1]) not in PAPER_NUMBERS:
            raise InputError(f"channel '{channel}': joints are numbered 0 to {max(PAPER_NUMBERS)}")
        bare = PAPER_NUMBERS[int(number[1])]
    return (f"{prefix}{bare}.{kind}",)


def resolve_channel(channel: str, skeleton: Skeleton) -> tuple[int, int]:
    """Joint index and channel index of a canonical ``joint.channel`` name in a skeleton.

    Raises:
        InputError: The skeleton has no such joint, or several.
    """
    joint, _, kind = channel.rpartition(".")
    return skeleton.index(joint), CHANNELS.index(kind)
