"""Warnings on stderr, which are printed also with ``--quiet``."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable

import click

__all__ = ["one_line", "plain_warnings", "warn"]

_LONGEST = 2000  # longest line [characters]


def warn(lines: Iterable[str], kind: str = "warning") -> None:
    """Write each line to stderr with its kind as a prefix: ``warning: …`` or ``suspicious: …``."""
    for line in lines:
        click.echo(f"{kind}: {one_line(line)}", err=True)


def one_line(text: str) -> str:
    """Text as one printable line of bounded length; line ends and control characters in names are escaped."""
    if len(text) > _LONGEST:
        text = f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}"
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def plain_warnings() -> None:
    """Show Python warnings as one line each; hide categories that are not for users, such as NumPy's rounding."""
    if sys.warnoptions:  # warnings configured by the user are left alone
        return

    def show(message: Warning | str, category: type[Warning], *place: object, **rest: object) -> None:
        warn([str(message)])

    warnings.showwarning = show
    for unheard in (RuntimeWarning, DeprecationWarning, FutureWarning, ResourceWarning, SyntaxWarning):
        warnings.simplefilter("ignore", unheard)
