"""Warnings: what is probably wrong goes to stderr, also where nothing else is said."""

from __future__ import annotations

from collections.abc import Iterable

import click

__all__ = ["warn"]


def warn(lines: Iterable[str], kind: str = "warning") -> None:
    """Write each line to stderr, its kind before it: ``warning: …`` or ``suspicious: …``."""
    for line in lines:
        click.echo(f"{kind}: {line}", err=True)
