"""Triangle meshes that kernels query: never empty, since a query of an empty one reads memory that is not its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["query_mesh"]


def query_mesh(points: Any, faces: NDArray[np.integer[Any]], *, winding: bool = False, device: str = "cpu") -> Any:
    """A ``warp.Mesh``.

    Args:
        points: Positions, shape (V, 3), or a ``warp.array`` of them on the device.
        faces: Triangles, shape (T, 3).
        winding: Whether it is asked for winding numbers.
        device: Where it is queried.

    Raises:
        InputError: It has no triangle.
    """
    import warp as wp

    if not len(faces):
        raise InputError("the surface is empty: it has no triangle with an area")
    places = (
        points if isinstance(points, wp.array) else wp.array(points.astype(np.float32), dtype=wp.vec3, device=device)
    )
    corners = wp.array(np.ascontiguousarray(faces, dtype=np.int32).ravel(), dtype=wp.int32, device=device)
    return wp.Mesh(places, corners, support_winding_number=winding)
