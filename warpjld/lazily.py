"""Functions by module and name: a table of what does each kind of file imports a library only when it is wanted."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["imported"]


def imported(place: tuple[str, str]) -> Any:
    """What ``(module, name)`` names, its module imported now."""
    module, name = place
    return getattr(import_module(module), name)
