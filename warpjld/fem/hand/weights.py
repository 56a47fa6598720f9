"""Smooth weights of the bones at all nodes of a hand's mesh, for blended motions of the flesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.harmonic import harmonic_field
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["bone_weights"]


def bone_weights(mesh: HexMesh, bones: Sequence[NDArray[np.int32]]) -> NDArray[np.float64]:
    """Harmonic weights: one at a bone's own nodes, falling smoothly to zero at those of others, shape (N, bones).

    Weights lie in 0…1 and rows sum to one (see ``harmonic_field``). Distances are through flesh, not through the air
    between fingers.

    Args:
        mesh: Mesh at rest.
        bones: Nodes of each bone.
    """
    own = np.zeros((len(mesh.nodes), len(bones)))
    for column, nodes in enumerate(bones):
        own[nodes, column] = 1.0
    out = np.clip(harmonic_field(mesh, own, own.sum(axis=1) != 0.0), 0.0, 1.0)
    weights: NDArray[np.float64] = out / out.sum(axis=1, keepdims=True)
    return weights
