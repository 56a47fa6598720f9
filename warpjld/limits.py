"""Limits on the sizes of inputs and computations, which can be changed by option or environment variable.

Each limit can be raised or lowered by ``warpjld --limit NAME=NUMBER …`` or the environment variable with its
name: ``WARPJLD_LIMIT_VERTICES`` for ``vertices``. Error messages name both. Limits keep damaged or malicious files
from exhausting memory; they are far above usual sizes.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

__all__ = ["LIMITS", "Limit", "check_limit", "limit", "set_limit", "variable"]


@dataclass(frozen=True)
class Limit:
    """One limit.

    Attributes:
        most: Default value.
        unit: Counted items, in the plural.
        about: What they belong to.
    """

    most: int
    unit: str
    about: str


LIMITS = {
    "file-bytes": Limit(2 << 30, "bytes", "a file that is read"),
    "json-bytes": Limit(24 << 20, "bytes", "a JSON file read whole, which takes up to six times as much memory"),
    "unpacked-bytes": Limit(1 << 30, "bytes", "what the members of an archive (.npz, .3mf, .usdz) unpack to"),
    "members": Limit(10_000, "members", "an archive"),
    "vertices": Limit(5_000_000, "vertices", "a surface"),
    "faces": Limit(10_000_000, "triangles", "a surface"),
    "pairs": Limit(20_000_000, "pairs", "points of a surface that nearly coincide"),
    "nodes": Limit(100_000, "nodes", "a scene"),
    "joints": Limit(1_024, "joints", "a skeleton"),
    "frames": Limit(2_000_000, "frames", "a motion or a scene"),
    "transforms": Limit(50_000_000, "transforms", "a motion: frames times joints"),
    "depth": Limit(200, "levels", "JSON and arithmetic, one inside the other"),
    "statements": Limit(100_000, "statements", "a script with its macros and include files written out"),
    "text": Limit(10_000, "characters", "a text in a script with its macro parameters put in"),
    "trials": Limit(1_000_000, "trials", "a study"),
    "instants": Limit(100_000, "instants", "a load step"),
    "reader-bytes": Limit(
        2 << 30, "bytes", "memory in which USD, FBX and meshio's meshes are read; five times that for large files"
    ),
    "reader-seconds": Limit(600, "seconds", "the process that reads USD or FBX"),
    "mesh-seconds": Limit(15, "seconds", "the process that reads a mesh by meshio, besides one a megabyte of it"),
    "elements": Limit(2_000_000, "elements", "a finite-element mesh"),
}
"""Limits by their names in ``--limit``; environment variables have them in capitals with underscores."""


def variable(name: str) -> str:
    """Name of the environment variable of a limit."""
    return f"WARPJLD_LIMIT_{name.replace('-', '_').upper()}"


def limit(name: str) -> int:
    """Value of a limit: that of its environment variable, or else the default.

    Raises:
        InputError: The environment variable is not an integer above 0.
    """
    stated = os.environ.get(variable(name))
    return LIMITS[name].most if stated is None else _number(stated, variable(name))


def set_limit(name: str, value: str) -> None:
    """Set a limit for this process and its child processes.

    Raises:
        InputError: There is no such limit, or the value is not an integer above 0.
    """
    if name not in LIMITS:
        raise InputError(f"--limit: there is no limit '{name}'{did_you_mean(name, LIMITS)}; known: {', '.join(LIMITS)}")
    os.environ[variable(name)] = str(_number(value, f"--limit {name}"))


def check_limit(name: str, count: float, *, of: str = "", path: str | Path | None = None) -> None:
    """Check a count against a limit, before memory is allocated.

    Args:
        name: Name of the limit in ``LIMITS``.
        count: The count.
        of: Description of what is counted, for the message.
        path: The file concerned.

    Raises:
        InputError: The count exceeds the limit.
    """
    most = limit(name)
    if not count <= most:
        of = f"{of}: " if of else ""
        raise InputError(
            f"{of}{count:,.0f} {LIMITS[name].unit}; the limit is {most:,} "
            f"(raise it by warpjld --limit {name}=… or {variable(name)})",
            path=path,
        )


def _number(text: str, what: str) -> int:
    try:
        value = int(float(text))
    except (ValueError, OverflowError):
        value = 0
    if value < 1:
        raise InputError(f"{what}: want a whole number above 0, got '{text[:40]}'")
    return value
