"""The RIG argument of commands: a file, or the built-in hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.rig import Rig

__all__ = ["open_rig"]


def open_rig(text: str) -> Rig:
    """The rig a user named: a path, ``builtin:left`` or ``builtin:right``.

    Raises:
        InputError: No such side, or a file that is no rig.
    """
    kind, colon, side = text.partition(":")
    if kind == "builtin" and colon:
        from warpjld.hand import build_hand

        if side not in ("left", "right"):
            raise InputError(f"no built-in hand '{side}': want builtin:left or builtin:right")
        return build_hand(side)
    from warpjld.io import load_rig

    return load_rig(text)
