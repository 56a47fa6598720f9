"""How deep inside a body something can be that has come in through a face.

Of two fingers side by side the back of one faces the palmar side of the other, as surfaces that overlap do, only a
whole finger deep. What has come in through a face is no deeper than the middle of the body under it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.surface import ContactSurface

__all__ = ["deepest"]

_BELOW = 0.02
"""Where rays begin under their face, in its edges."""
_LEAST = 0.5
"""Depth that is looked at under any face, in its edges."""


def deepest(surface: ContactSurface, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the thickness of the body under each face with its nodes at x (N, 3) [m], shape (F,); infinite where the
    surface is open on the other side."""
    import warp as wp
    from warpjld_kernels import contact_depth

    nodes = x[surface.nodes]
    origin, size = nodes.mean(axis=0), max(float(np.ptp(nodes, axis=0).max()), 1e-300)
    corners = surface.corners
    triangles = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]).astype(np.int32)
    mesh = wp.Mesh(
        wp.array(((nodes - origin) / size).astype(np.float32), dtype=wp.vec3, device="cpu"),
        wp.array(triangles.ravel(), dtype=wp.int32, device="cpu"),
    )
    vectors = surface.area_vectors(x)
    area = np.linalg.norm(vectors, axis=1)
    edge = np.sqrt(area)
    inward = -vectors / np.maximum(area, 1e-300)[:, None]
    # half-way along the diagonal a face that is not flat lies on its triangles
    start = 0.5 * (nodes[corners[:, 0]] + nodes[corners[:, 2]]) + _BELOW * edge[:, None] * inward
    farthest = 4.0
    found = wp.empty(len(corners), dtype=float, device="cpu")
    rays = [((start - origin) / size).astype(np.float32), inward.astype(np.float32)]
    inputs = [mesh.id, *(wp.array(r, dtype=wp.vec3, device="cpu") for r in rays), farthest]
    wp.launch(contact_depth.thickness, dim=len(corners), inputs=[*inputs, found], device="cpu")
    way = found.numpy().astype(np.float64)
    half = np.where(way < farthest, 0.5 * way * size, np.inf)
    return np.maximum(half, _LEAST * edge)
