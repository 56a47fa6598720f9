"""Warp devices by name, and arrays and parameters on them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.covering.parameters import Parameters
from warpjld.errors import InputError

if TYPE_CHECKING:
    import warp as wp

__all__ = ["array_on", "checked_device", "parameters_on", "shared_on"]


def checked_device(name: str) -> wp.Device:
    """The Warp device of that name; InputError with the available ones where there is none."""
    import warp as wp

    wp.init()
    known = ", ".join(str(d) for d in wp.get_devices())
    if name.startswith("cuda") and not wp.get_cuda_devices():  # asking for one prints what the driver says
        raise InputError(f"device '{name}' is not available; want one of: {known}")
    try:
        return wp.get_device(name)
    except (ValueError, RuntimeError) as error:  # RuntimeError: no driver for any CUDA device
        raise InputError(f"device '{name}' is not available; want one of: {known}") from error


def parameters_on(device: wp.Device, parameters: Parameters) -> Any:
    """The parameters as the kernels' struct ``warpjld_kernels.paper.Parameters`` on a device."""
    from warpjld_kernels import paper

    out = paper.Parameters()
    for name in ("inflation", "proximity", "muscle", "peak", "exponents", "palm"):
        setattr(out, name, array_on(device, getattr(parameters, name), float))
    return out


def shared_on(device: Any, values: np.ndarray, kind: Any) -> Any:
    """A Warp array of values: on the CPU their own memory, elsewhere a copy; its ``numpy()`` has what kernels wrote."""
    import warp as wp

    return wp.array(values, dtype=kind, device=device, copy=False)


def array_on(device: Any, values: np.ndarray, kind: Any, *, requires_grad: bool = False) -> Any:
    """A Warp array of float32 or int32 on a device, converted to that type."""
    import warp as wp

    plain = np.array(values, dtype=np.int32 if kind is wp.int32 else np.float32, order="C")
    # on the CPU it wraps this copy: NumPy makes one in a tenth of Warp's time
    return wp.array(plain, dtype=kind, device=device, copy=False, requires_grad=requires_grad)
