"""Lazy imports, so that commands which need few libraries start quickly."""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["imported", "lazy_module"]


def imported(place: tuple[str, str]) -> Any:
    """The object that ``(module, name)`` refers to, imported now; for tables of readers and writers by suffix."""
    module, name = place
    return getattr(import_module(module), name)


def lazy_module(name: str) -> Any:
    """A proxy of a module that is imported when one of its attributes is first used.

    Importing a SciPy module takes a quarter of a second or more, as long as deforming a clip with a stored binding.
    """
    return _LazyModule(name)


class _LazyModule:
    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        found = getattr(import_module(self._name), attribute)
        setattr(self, attribute, found)  # later accesses bypass __getattr__
        return found
