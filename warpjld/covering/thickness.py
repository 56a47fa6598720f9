"""How thick a limb is at every vertex: how far the skin lies from its bones, and how much room there is beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.normals import vertex_normals

__all__ = ["room"]

_INSET = 1e-4  # of the surface's size, so that a ray does not meet the face it starts from


def room(vertices: NDArray[np.float64], faces: NDArray[np.int32], offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Thickness at every vertex [m], shape (V,): the length of its offset from its bones, and at most half of the gap
    to the surface outside it.

    Between two thighs, or between fingers side by side, fields that reached as far as the limb is thick would draw each
    limb's skin along with the other's.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        offsets: From the bones [m], shape (V, 3).
    """
    import warp as wp
    from warpjld_kernels.visibility import gap_outside

    wp.init()
    thickness = np.linalg.norm(offsets, axis=1)
    if not len(faces):
        return np.asarray(thickness)
    centre = vertices.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    places = wp.array((vertices - centre).astype(np.float32), dtype=wp.vec3, device="cpu")
    mesh = wp.Mesh(places, wp.array(faces.ravel(), dtype=wp.int32, device="cpu"))
    normals = wp.array(vertex_normals(vertices, faces), dtype=wp.vec3, device="cpu")
    gap = wp.empty(len(vertices), dtype=float, device="cpu")
    inputs = [mesh.id, places, normals, _INSET * size, 2.0 * float(thickness.max(initial=0.0))]
    wp.launch(gap_outside, dim=len(vertices), inputs=inputs, outputs=[gap], device="cpu")
    return np.asarray(np.minimum(thickness, gap.numpy() / 2.0 + _INSET * size))
