"""Arrays of a kernel's struct that are filled anew: on the CPU, making arrays costs more than filling them."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from warpjld.covering.device import array_on

__all__ = ["StructArrays"]


class StructArrays:
    """A struct of Warp arrays. On the CPU an array is kept, and filled from its first row on, while it is long enough.

    Only for structs that are used before they are filled again.

    Args:
        struct: Instance of a Warp struct.
        device: Warp device of its arrays, ``warp.Device``.

    Attributes:
        struct: As given.
    """

    def __init__(self, struct: Any, device: Any) -> None:
        self.struct, self._device = struct, device
        self._kept: dict[str, NDArray] = {}

    def fill(self, name: str, values: NDArray, kind: Any) -> None:
        """Set a field to values, converted to the Warp type ``kind``."""
        kept = self._kept.get(name)
        if kept is not None and len(kept) >= len(values) and kept.shape[1:] == values.shape[1:]:
            kept[: len(values)] = values
            return
        array = array_on(self._device, values, kind)
        setattr(self.struct, name, array)
        if self._device.is_cpu:
            self._kept[name] = array.numpy()  # a view of the same memory
