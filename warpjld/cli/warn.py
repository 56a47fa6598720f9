"""Warnings: what is probably wrong goes to stderr, also where nothing else is said."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable

import click

__all__ = ["one_line", "plain_warnings", "warn"]

_LONGEST = 2000  # characters of a line


def warn(lines: Iterable[str], kind: str = "warning") -> None:
    """Write each line to stderr, its kind before it: ``warning: …`` or ``suspicious: …``."""
    for line in lines:
        click.echo(f"{kind}: {one_line(line)}", err=True)


def one_line(text: str) -> str:
    """Text as one line of bounded length: names in files may hold line ends, or what terminals take for commands."""
    if len(text) > _LONGEST:
        text = f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}"
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def plain_warnings() -> None:
    """Warnings of libraries: one line each where they are meant for users, none where NumPy speaks of rounding."""
    if sys.warnoptions:  # whoever asks Python for warnings gets them
        return

    def show(message: Warning | str, category: type[Warning], *place: object, **rest: object) -> None:
        warn([str(message)])

    warnings.showwarning = show
    for unheard in (RuntimeWarning, DeprecationWarning, FutureWarning, ResourceWarning, SyntaxWarning):
        warnings.simplefilter("ignore", unheard)
