"""What commands take for RIG: a file, or the built-in hand."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.rig import Rig

__all__ = ["open_rig"]


def open_rig(text: str, *, skeleton: Path | None = None, side: str | None = None) -> Rig:
    """The rig a command names.

    Args:
        text: A path, or ``builtin:left`` or ``builtin:right``.
        skeleton: Skeleton file of a surface without joints.
        side: Of a single hand whose file leaves it open.

    Raises:
        InputError: An unknown built-in rig, or a file that cannot be used.
    """
    kind, colon, name = text.partition(":")
    if kind == "builtin" and colon:
        from warpjld.hand import build_hand

        if name not in ("left", "right"):
            raise InputError(f"no built-in rig '{name}'; there are builtin:left and builtin:right")
        return build_hand(name)
    from warpjld.io import load_rig

    return load_rig(text, skeleton=skeleton, side=side)
