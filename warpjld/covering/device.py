"""Host arrays to the kernels' structs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.covering.binding import Anchors
from warpjld.covering.drivers import Drivers
from warpjld.covering.parameters import Parameters
from warpjld.errors import InputError

if TYPE_CHECKING:
    import warp as wp

__all__ = ["anchors_on", "array_on", "checked_device", "drivers_on", "parameters_on"]


def checked_device(name: str) -> wp.Device:
    """The Warp device of that name, or an InputError that lists those there are."""
    import warp as wp

    wp.init()
    try:
        return wp.get_device(name)
    except ValueError as error:
        known = ", ".join(str(d) for d in wp.get_devices())
        raise InputError(f"device '{name}' is not available; there are: {known}") from error


def anchors_on(device: wp.Device, anchors: Anchors, rest_joints: np.ndarray) -> Any:
    """``warpjld_kernels.anchored.Anchors`` on a device."""
    import warp as wp
    from warpjld_kernels import anchored

    out = anchored.Anchors()
    for name, kind in (
        ("ends", wp.int32),
        ("muscle", float),
        ("rest", wp.vec3),
        ("segment", wp.int32),
        ("weight", float),
        ("ratio", float),
        ("side", float),
        ("lift", wp.vec3),
        ("pairs", wp.int32),
        ("pair", wp.int32),
        ("between", float),
        ("station", float),
        ("rigid", wp.int32),
    ):
        setattr(out, name, array_on(device, getattr(anchors, name), kind))
    out.rest_joints = array_on(device, rest_joints, wp.vec3)
    return out


def parameters_on(device: wp.Device, parameters: Parameters, *, requires_grad: bool = False) -> Any:
    """``warpjld_kernels.anchored.Parameters`` on a device."""
    from warpjld_kernels import anchored

    out = anchored.Parameters()
    for name in ("inflation", "proximity", "muscle", "peak", "exponents", "palm"):
        setattr(out, name, array_on(device, getattr(parameters, name), float, requires_grad=requires_grad))
    return out


def drivers_on(device: wp.Device, drivers: Drivers, *, requires_grad: bool = False) -> list[Any]:
    """Pose arguments of ``deform_points``, in its order."""
    import warp as wp

    kinds = (
        ("positions", wp.vec3),
        ("halfway", wp.quat),
        ("rotations", wp.quat),
        ("flexion_ratio", float),
        ("closing", float),
    )
    return [array_on(device, getattr(drivers, name), kind, requires_grad=requires_grad) for name, kind in kinds]


def array_on(device: Any, values: np.ndarray, kind: Any, *, requires_grad: bool = False) -> Any:
    """An array of float32 or int32 on a device."""
    import warp as wp

    plain = np.ascontiguousarray(values, dtype=np.int32 if kind is wp.int32 else np.float32)
    return wp.array(plain, dtype=kind, device=device, requires_grad=requires_grad)
