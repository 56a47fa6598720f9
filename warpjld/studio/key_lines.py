"""Keys as lines of a script: set by replacing the number of a line at the end, or by a line more."""

from __future__ import annotations

import re
from collections.abc import Mapping

__all__ = ["number", "with_keys"]

_KEY = re.compile(r"JOINT (?P<joint>\S+) (?P<channel>[A-Z]+) AT (?P<frame>\S+) (?P<value>\S+)\Z")


def with_keys(text: str, angles: Mapping[str, float], frame: float, *, actor: str | None = None) -> str:
    """A script with keys of some channels at a frame.

    Lines that set keys and stand last in the script are edited in place, since nothing that follows could depend on
    them; others are left as they are, and overruled by lines at the end.

    Args:
        text: The script.
        angles: Degrees by channel, such as ``left.index.base.flexion``.
        frame: The key.
        actor: Name of the actor to speak to first, where it is not the current one.
    """
    lines = text.rstrip("\n").split("\n") if text.strip() else []
    if actor is not None:
        lines.append(f"ACTOR {actor}")
    found: dict[tuple[str, str, str], int] = {}
    for k in range(len(lines) - 1, -1, -1):
        match = _KEY.match(lines[k])
        if match is None:
            break
        found.setdefault((match["joint"], match["channel"], match["frame"]), k)
    for name, degrees in angles.items():
        joint, _, channel = name.rpartition(".")
        key = (joint, channel.upper(), number(frame))
        line = f"JOINT {joint} {key[1]} AT {key[2]} {number(degrees)}"
        if key in found:
            lines[found[key]] = line
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """A number as a script has it, to a hundredth."""
    return f"{round(value, 2) + 0.0:.10g}"
