"""Morph targets at their default weights, which define the displayed shape without animation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.gltf.document import Document

__all__ = ["morphed"]


def morphed(
    document: Document, primitive: Any, node: int, points: NDArray[np.float64], name: str
) -> NDArray[np.float64]:
    """A primitive's positions with morph targets added, by the weights of the node or else of its mesh, shape (V, 3).

    Raises:
        InputError: Fewer weights than targets, or targets of wrong shape.
    """
    targets = primitive.targets or []
    mesh = document.gltf.meshes[document.gltf.nodes[node].mesh]
    weights = document.content["nodes"][node].get("weights") or mesh.weights or []
    if not any(weights):
        return points
    if len(weights) < len(targets):
        raise InputError(f"mesh '{name}': {len(targets)} morph targets, but {len(weights)} weights", path=document.path)
    out = points.copy()
    for target, weight in zip(targets, weights, strict=False):
        accessor = (target if isinstance(target, dict) else vars(target)).get("POSITION")
        if accessor is None or weight == 0.0:
            continue
        shift = document.accessor(accessor)
        if shift.shape != points.shape:
            raise InputError(f"mesh '{name}': a morph target moves {len(shift)} of {len(points)}", path=document.path)
        out += weight * shift
    return out
