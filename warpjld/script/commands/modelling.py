"""Objects that a script models: surfaces of revolution, sweeps, soft objects (A3, A8, B3.1, R135, R137)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.errors import InputError
from warpjld.geometry.lengths import LARGEST
from warpjld.script.arguments import Arguments

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject

__all__ = ["modelled"]

_MOST = 10_000
"""Largest number of points of a profile, a path or a soft object."""


def modelled(arguments: Arguments, shape: str, name: str) -> GraspObject:
    """Read the numbers of a ``REVOLVE``, ``SWEEP`` or ``SOFT`` shape, and make the object."""
    from warpjld.grasp.modelled import revolved, soft, swept

    where = arguments.last
    try:
        if shape == "revolve":
            return revolved(_rows(arguments, "the profile's", ("distance from the axis", "y")), name=name)
        if shape == "sweep":
            outline = _rows(arguments, "the outline's", ("u", "v"))
            arguments.choice("ALONG and the points of a path", ("ALONG",))
            return swept(outline, _rows(arguments, "the path's", ("x", "y", "z")), name=name)
        rows = _rows(arguments, "the key point's", ("x", "y", "z", "radius"))
        return soft([row[:3] for row in rows], [row[3] for row in rows], name=name)
    except InputError as error:
        raise (error if error.line is not None else arguments.error(error.message, where)) from None


def _rows(arguments: Arguments, whose: str, names: tuple[str, ...]) -> list[list[float]]:
    """Read points, one number for each name, up to the next word."""
    rows: list[list[float]] = []
    while not rows or arguments.has_number():
        rows.append([arguments.number(f"{whose} {name}", minimum=-LARGEST, maximum=LARGEST) for name in names])
        if len(rows) > _MOST:
            raise arguments.error(f"more than {_MOST:,} points")
    return rows
