"""Lazy imports, so that commands which need few libraries start quickly."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

__all__ = ["imported", "lazy_module", "lazy_names"]


def imported(place: tuple[str, str]) -> Any:
    """The object that ``(module, name)`` refers to, imported now; for tables of readers and writers by suffix."""
    module, name = place
    return getattr(import_module(module), name)


def lazy_module(name: str) -> Any:
    """A proxy of a module that is imported when one of its attributes is first used.

    Importing a SciPy module takes a quarter of a second or more, as long as deforming a clip with a stored binding.
    """
    return _LazyModule(name)


def lazy_names(package: str, where: dict[str, str]) -> Callable[[str], Any]:
    """``__getattr__`` of a package whose names are imported when they are first asked for (PEP 562).

    Args:
        package: The package's full name.
        where: Public name → module below the package that defines it. A name that is also a module's would be that
            module for whoever imports the module first, and is refused.

    Raises:
        ValueError: A name is also its module's.
    """
    same = [name for name, module in where.items() if name in module.split(".")]
    if same:
        raise ValueError(f"{package}: {same[0]} is a module and a name in it")

    def attribute(name: str) -> Any:
        if name not in where:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        found = getattr(import_module(f"{package}.{where[name]}"), name)
        setattr(sys.modules[package], name, found)  # from now on it is an attribute like any other
        return found

    return attribute


class _LazyModule:
    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        found = getattr(import_module(self._name), attribute)
        setattr(self, attribute, found)  # later accesses bypass __getattr__
        return found
