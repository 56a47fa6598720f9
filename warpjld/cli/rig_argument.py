"""The RIG argument of commands: a file, or the built-in hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.rig import Rig

__all__ = ["open_rig"]


def open_rig(
    text: str,
    *,
    skeleton: Path | None = None,
    side: str | None = None,
    unit: str | None = None,
    up: str | None = None,
) -> Rig:
    """The rig a user named: a path, ``builtin:left`` or ``builtin:right``.

    Args:
        text: What stands on the command line.
        skeleton: Skeleton file for a surface without joints; likewise ``side``, ``unit`` and ``up`` as in ``load_rig``.

    Raises:
        InputError: No such side, a file that is no rig, or options that only files take.
    """
    kind, colon, which = text.partition(":")
    if kind != "builtin" or not colon:
        from warpjld.io import load_rig

        return load_rig(text, skeleton=skeleton, side=side, unit=unit, up=up)
    if which not in ("left", "right"):
        raise InputError(f"no built-in hand '{which}': want builtin:left or builtin:right")
    if any(option is not None for option in (skeleton, side, unit, up)):
        raise InputError(f"{text}: --skeleton, --side, --unit and --up are for files")
    from warpjld.hand import build_hand

    return build_hand(which)
