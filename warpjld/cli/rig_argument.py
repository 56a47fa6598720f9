"""The RIG argument of commands: a file, a built-in hand, or the built-in body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.cli.warn import warn
from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.rig import Rig

__all__ = ["open_rig", "rig_files"]

_OPTIONS = {
    "joint_map": "map",
    "centre_joints": "centre-joints",
}  # options that are called otherwise than the arguments of load_rig


def open_rig(text: str, **how: Any) -> Rig:
    """Open the RIG argument: a path, ``builtin:left``, ``:right`` or ``:body``; suspicious findings go to stderr.

    Args:
        text: The argument.
        how: Keyword arguments of ``load_rig`` from ``options.rig``; None for options that were not given.

    Raises:
        InputError: No such built-in rig, a file that is no rig, or options that only apply to files.
    """
    kind, colon, which = text.partition(":")
    if kind != "builtin" or not colon:
        from warpjld.io.kept_rig import kept_rig

        rig = kept_rig(text, **how)
        warn(rig.suspicious, "suspicious")
        return rig
    if which not in ("left", "right", "body"):
        raise InputError(f"there is no built-in rig '{which}': want builtin:left, builtin:right or builtin:body")
    given = [f"--{_OPTIONS.get(name, name)}" for name, value in how.items() if value is not None]
    if given:
        raise InputError(f"{text}: {', '.join(given)} only work for files")
    if which == "body":
        from warpjld.hand.figure import build_body

        return build_body()
    from warpjld.hand.kept import kept_hand

    return kept_hand(which)


def rig_files(text: str, how: dict[str, Any]) -> list[Path]:
    """Files that ``open_rig`` reads for the same arguments."""
    from warpjld.io.identity import files_of

    given = [Path(text), *(value for value in how.values() if isinstance(value, Path))]
    return [file for path in given for file in (path, *files_of(path))]
