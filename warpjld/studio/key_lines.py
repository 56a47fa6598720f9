"""Editing of values in a script's text: replace a value in the last lines, or append a line."""

from __future__ import annotations

import re
from collections.abc import Mapping

__all__ = ["number", "with_keys", "with_values"]

_VALUE = re.compile(
    r"(?P<what>JOINT \S+ [A-Z]+ AT \S+|(?:MOVE|TURN) \S+ \S+|PARAMETER \S+ (?:INFLATION|PROXIMITY|MUSCLE|PEAK|PALM)) "
    r"[-+.\d\seE]+\Z"
)


def with_values(text: str, values: Mapping[str, str], *, actor: str | None = None) -> str:
    """Script with lines that set values.

    Value lines at the end of the script are edited in place, since nothing after them can depend on them; values set
    earlier are overridden by new lines at the end.

    Args:
        text: The script.
        values: Values by the beginning of their line, such as ``MOVE LEFT 20`` → ``0 0.1 0``.
        actor: Name of the actor to select first, if it is not the current one.
    """
    lines = text.rstrip("\n").split("\n") if text.strip() else []
    if actor is not None:
        lines.append(f"ACTOR {actor}")
    found: dict[str, int] = {}
    for k in range(len(lines) - 1, -1, -1):
        match = _VALUE.match(lines[k])
        if match is None:
            break
        found.setdefault(match["what"], k)
    for what, value in values.items():
        if what in found:
            lines[found[what]] = f"{what} {value}"
        else:
            lines.append(f"{what} {value}")
    return "\n".join(lines) + "\n"


def with_keys(text: str, angles: Mapping[str, float], frame: float, *, actor: str | None = None) -> str:
    """As ``with_values``, for keys [degrees] of channels such as ``left.index.base.flexion`` at a frame."""
    values = {}
    for name, degrees in angles.items():
        joint, _, channel = name.rpartition(".")
        values[f"JOINT {joint} {channel.upper()} AT {number(frame)}"] = number(degrees)
    return with_values(text, values, actor=actor)


def number(value: float, digits: int = 2) -> str:
    """A number formatted for a script, rounded to ``digits`` decimals."""
    return f"{round(value, digits) + 0.0:.10g}"
