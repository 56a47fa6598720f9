"""Libraries that are imported when they are first wanted: a command starts quickly that needs few of them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["imported", "lazy_module"]


def imported(place: tuple[str, str]) -> Any:
    """What ``(module, name)`` names, its module imported now: for tables of what does each kind of file."""
    module, name = place
    return getattr(import_module(module), name)


def lazy_module(name: str) -> Any:
    """A module that is imported when something of it is first asked for.

    SciPy's take a quarter of a second and more each, as long as a kept binding takes to deform a clip.
    """
    return _LazyModule(name)


class _LazyModule:
    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        found = getattr(import_module(self._name), attribute)
        setattr(self, attribute, found)  # from now on it is an attribute like any other
        return found
