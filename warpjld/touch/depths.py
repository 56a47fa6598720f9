"""How deep the vertices of a frame lie inside other parts of the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.normals import vertex_normals
from warpjld.touch.patches import Patches

__all__ = ["Depths", "Finder"]


@dataclass(frozen=True, eq=False)
class Depths:
    """Overlap of one frame.

    Attributes:
        depth: How deep [m] each vertex is inside another part, 0 for none, shape (V,).
        way: Unit way out of it, shape (V, 3).
        other: The part, -1 for none, shape (V,).
        normals: Vertex normals, shape (V, 3).
    """

    depth: NDArray[np.float64]
    way: NDArray[np.float64]
    other: NDArray[np.int32]
    normals: NDArray[np.float64]


class Finder:
    """Meshes of the parts, made once and refitted each frame."""

    def __init__(self, patches: Patches, vertices: NDArray[np.floating]) -> None:
        import warp as wp

        wp.init()
        self.patches = patches
        count = len(patches.names)
        self._corners = [np.unique(patches.faces_of(k)) for k in range(count)]
        self._kept = [k for k in range(count) if len(self._corners[k])]
        where = np.full(count + 1, -1, dtype=np.int32)
        where[self._kept] = np.arange(len(self._kept), dtype=np.int32)
        self._points = wp.array(np.asarray(vertices, np.float32), dtype=wp.vec3, device="cpu")
        self._meshes = [
            wp.Mesh(self._points, wp.array(patches.faces_of(k).ravel(), dtype=wp.int32, device="cpu"))
            for k in self._kept
        ]
        self._ids = wp.array([m.id for m in self._meshes], dtype=wp.uint64, device="cpu")
        self._part = wp.array(where[patches.part], dtype=wp.int32, device="cpu")
        # nothing lies deeper in flesh than it is thick; half more, for flesh that swells
        thick = [1.5 * float(patches.thickness[c].max()) for c in (self._corners[k] for k in self._kept)]
        self._farthest = wp.array(thick, dtype=float, device="cpu")
        self._inner = wp.array(patches.inner.astype(np.float32), dtype=float, device="cpu")
        self._out: list[Any] = [
            wp.empty(len(vertices), dtype=kind, device="cpu") for kind in (float, wp.vec3, wp.int32)
        ]

    def __call__(self, points: NDArray[np.floating]) -> Depths:
        """Depths at vertices (V, 3)."""
        import warp as wp
        from warpjld_kernels.touch_depth import touch_depth

        there = np.asarray(points, dtype=np.float32)
        self._points.numpy()[...] = there
        for mesh in self._meshes:
            mesh.refit()
        normals = vertex_normals(points, self.patches.faces)
        boxes = [(there[c].min(axis=0), there[c].max(axis=0)) for c in (self._corners[k] for k in self._kept)]
        low, high = (wp.array([b[i] for b in boxes], dtype=wp.vec3, device="cpu") for i in (0, 1))
        wp.launch(
            touch_depth,
            len(there),
            inputs=[
                self._points,
                wp.array(normals, dtype=wp.vec3, device="cpu"),
                self._part,
                self._ids,
                low,
                high,
                self._farthest,
                self._inner,
            ],
            outputs=self._out,
            device="cpu",
        )
        depth, way, other = (a.numpy().copy() for a in self._out)
        kept = np.array([*self._kept, -1], dtype=np.int32)
        return Depths(depth.astype(np.float64), way.astype(np.float64), kept[other], normals.astype(np.float64))
