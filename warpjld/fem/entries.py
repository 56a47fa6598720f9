"""Checking entries of a study file against what they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from warpjld.errors import InputError

__all__ = ["like", "one_of", "three_numbers", "whole"]


def like(where: str, value: Any, default: object) -> None:
    """Refuse an entry that is not of its default's kind; a default of None stands for a whole number.

    Raises:
        InputError: Names the entry and what it wants.
    """
    if isinstance(default, bool):
        good, wanted = isinstance(value, bool), "true or false"
    elif default is None or isinstance(default, int):
        good, wanted = _number(value) and not isinstance(value, float), "a whole number"
    elif isinstance(default, float):
        good, wanted = _number(value), "a number"
    elif isinstance(default, str):
        good, wanted = isinstance(value, str), "a text"
    else:
        good = isinstance(value, Sequence) and not isinstance(value, str) and all(map(_number, value))
        wanted = "an array of numbers"
    if not good:
        raise InputError(f"{where}: want {wanted}, got {value!r}")


def one_of(where: str, value: Any, known: Sequence[str]) -> str:
    """A word of a list; InputError names the list."""
    if value not in known:
        raise InputError(f"{where}: want one of {', '.join(known)}, got {value!r}")
    return str(value)


def three_numbers(where: str, value: Any) -> tuple[float, float, float]:
    """A vector; InputError where it is none."""
    like(where, value, ())
    if len(value) != 3:
        raise InputError(f"{where}: want three numbers, got {value!r}")
    x, y, z = (float(v) for v in value)
    return x, y, z


def whole(where: str, value: Any, least: int) -> int:
    """A whole number from ``least`` on; InputError where it is none."""
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InputError(f"{where}: want a whole number from {least} on, got {value!r}")
    return value


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
