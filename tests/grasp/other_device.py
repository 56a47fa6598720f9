"""A device that only pretends to be another: arrays on it are copies, and kernels may be given no others.

What a GPU would show and a machine without one cannot: a launch without a device, an array of another device, and a
result that is not brought back. Kernels themselves run on the CPU.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import warp as wp

__all__ = ["OtherDevice", "pretend"]


class OtherDevice:
    """The device; ``launched`` are the names of the kernels that ran on it."""

    is_cpu = False
    is_cuda = True

    def __init__(self) -> None:
        self.launched: set[str] = set()

    def __str__(self) -> str:
        return "elsewhere"


def pretend(patch: pytest.MonkeyPatch) -> OtherDevice:
    """Let Warp know such a device."""
    there = OtherDevice()

    def at(device: Any) -> bool:
        return device is there or device == str(there)

    init, numpy, to, launch = wp.array.__init__, wp.array.numpy, wp.array.to, wp.launch

    def made(self: Any, *values: Any, **how: Any) -> None:
        away = at(how.get("device"))
        if away:
            how |= {"device": "cpu"} | ({"copy": True} if "copy" in how else {})
        init(self, *values, **how)
        self.elsewhere = away

    def read(self: Any) -> np.ndarray:
        return numpy(self).copy() if _elsewhere(self) else numpy(self)

    def brought(self: Any, device: Any, *more: Any, **how: Any) -> Any:
        if not at(device):
            return to(self, device, *more, **how)
        if _elsewhere(self):
            return self
        copy = wp.clone(self)
        copy.elsewhere = True
        return copy

    def launched(kernel: Any, *more: Any, **how: Any) -> Any:
        here = _given(how.get("inputs", ())), _given(how.get("outputs", ()))
        away = at(how["device"])  # a launch says where
        wrong = [array for arrays in here for array in arrays if array.size and _elsewhere(array) != away]
        assert not wrong, f"{kernel.key}: {len(wrong)} arrays are on the other device"
        if away:
            there.launched.add(kernel.key)
            how["device"] = "cpu"
        return launch(kernel, *more, **how)

    def filled(of: Any) -> Any:
        def make(*values: Any, device: Any = None, **how: Any) -> Any:
            array = of(*values, device="cpu" if at(device) else device, **how)
            array.elsewhere = at(device)
            return array

        return make

    patch.setattr(wp.array, "__init__", made)
    patch.setattr(wp.array, "numpy", read)
    patch.setattr(wp.array, "to", brought)
    patch.setattr(wp, "launch", launched)
    for name in ("zeros", "empty", "full"):
        patch.setattr(wp, name, filled(getattr(wp, name)))
    return there


def _elsewhere(array: Any) -> bool:
    return bool(getattr(array, "elsewhere", False))


def _given(values: Any) -> list[Any]:
    """Arrays among a kernel's arguments, those of structs too."""
    return [array for value in values for array in _arrays(value)]


def _arrays(value: Any) -> Iterator[Any]:
    if isinstance(value, wp.array):
        yield value
    elif hasattr(value, "_cls") and hasattr(value._cls, "vars"):
        for name in value._cls.vars:
            yield from _arrays(getattr(value, name))
