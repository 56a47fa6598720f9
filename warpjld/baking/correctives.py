"""Corrective shapes: the residual of blend skinning as a few shapes that joint rotations drive.

The error of blend skinning at frame f is mapped back to the bind pose by the inverse of each vertex's blended matrix,
since engines add shapes before they skin. Every bone's rotation relative to its parent, a quaternion x, y, z, w with
w ≥ 0, gives 19 features: the products of one to three of x, y, z (``PRODUCTS``). Ridge regressions predict the errors
from them, one for the skin of each bone, from the features of only those bones that deform it (``predicted_errors``).
The K directions of largest variance of the prediction are the shapes (reduced-rank regression: Izenman 1975): no K
other shapes, driven by these features, come nearer to the prediction, so that joints get shapes by what these take off.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from warpjld.baking.predicted import Prediction, predicted_errors

__all__ = ["PRODUCTS", "Correctives", "features", "fit_correctives", "no_correctives"]

_DAMPING = 1e-2  # damping of inverses of nearly singular blended matrices (candy-wrapper artefacts)
_SMALLEST_DRIVE = (
    1e-4  # share of a joint's energy in a shape's weight, of the strongest joint's, below which it is none
)
PRODUCTS = tuple(chosen for degree in (1, 2, 3) for chosen in combinations_with_replacement(range(3), degree))
"""Which of x, y, z of a quaternion each feature multiplies."""
_FRAMES = 16  # frames mapped back at once, which bounds memory
_COLUMNS = 30_000  # coordinates whose products are added up at once, likewise


@dataclass(frozen=True, eq=False)
class Correctives:
    """K shapes and the linear functions of joint rotations that drive them.

    Attributes:
        shapes: Displacements in the bind pose [m], shape (K, V, 3).
        drivers: Coefficient of every feature of every bone in a shape's weight, shape (K, B, 19).
        span: Smallest and largest weight over the poses fitted to, zero included, shape (K, 2).
    """

    shapes: NDArray[np.float64]
    drivers: NDArray[np.float64]
    span: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))

    def __len__(self) -> int:
        return len(self.shapes)

    def weights(self, turns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights of the shapes, shape (F, K), from rotations of bones relative to their parents (F, B, 4)."""
        return np.einsum("fbn,kbn->fk", features(turns), self.drivers, optimize=True)


def no_correctives(vertices: int, bones: int) -> Correctives:
    """An empty set of shapes."""
    return Correctives(np.zeros((0, vertices, 3)), np.zeros((0, bones, len(PRODUCTS))))


def features(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Features of quaternions (F, B, 4), shape (F, B, 19)."""
    return np.stack([turns[..., list(chosen)].prod(axis=-1) for chosen in PRODUCTS], axis=-1)


def fit_correctives(
    errors: NDArray[np.float64],
    blended: NDArray[np.float32],
    turns: NDArray[np.float64],
    skin: csc_array,
    count: int,
) -> Correctives:
    """Fit K = ``count`` shapes to the residual of blend skinning in F frames.

    Args:
        errors: Target minus skinned position [m], shape (F, V, 3).
        blended: Linear part of every vertex's blended transform, shape (F, V, 3, 3).
        turns: Rotations of the bones relative to their parents, shape (F, B, 4).
        skin: Weight of every bone at every vertex, shape (V, B).
        count: Number of shapes, at most F.
    """
    back = np.empty(errors.shape, dtype=np.float32)
    for start in range(0, len(errors), _FRAMES):
        part = slice(start, start + _FRAMES)
        normal = np.einsum("fvji,fvjk->fvik", blended[part], blended[part]) + _DAMPING * np.eye(3)
        right = np.einsum("fvji,fvj->fvi", blended[part], errors[part])
        back[part] = np.linalg.solve(normal, right[..., None])[..., 0] * (1.0 + _DAMPING)
    inputs = features(turns)
    found = predicted_errors(back, inputs, skin)
    shapes = _strongest(found.errors.reshape(len(back), -1), count)
    drivers = _drivers(found, inputs, shapes)
    weights = np.einsum("fbn,kbn->fk", inputs, drivers, optimize=True)
    span = np.column_stack([np.minimum(weights.min(axis=0), 0.0), np.maximum(weights.max(axis=0), 0.0)])
    return Correctives(shapes.reshape(len(shapes), -1, 3), drivers, span)


def _strongest(rows: NDArray[np.float32], count: int) -> NDArray[np.float64]:
    """At most ``count`` orthonormal directions (K, N) of largest variance, about zero, of rows (F, N)."""
    between = np.zeros((len(rows), len(rows)))
    for start in range(0, rows.shape[1], _COLUMNS):
        block = rows[:, start : start + _COLUMNS].astype(np.float64)
        between += block @ block.T
    spread, directions = np.linalg.eigh(between)
    kept = np.argsort(-spread)[:count]
    kept = kept[spread[kept] > 1e-12 * max(float(spread.max()), 1e-300)]
    mixing = (directions[:, kept] / np.sqrt(spread[kept])).T
    return np.concatenate(
        [mixing @ rows[:, start : start + _COLUMNS] for start in range(0, rows.shape[1], _COLUMNS)], axis=1
    )


def _drivers(found: Prediction, inputs: NDArray[np.float64], shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (K, B, 19) of the features (F, B, 19) in the weights of orthonormal shapes (K, 3 V); those of bones
    that hardly drive a shape are zero."""
    bones = inputs.shape[1]
    drivers = np.zeros((len(shapes), bones, inputs.shape[2]))
    by_vertex = shapes.reshape(len(shapes), -1, 3)
    for part in found.parts:
        along = by_vertex[:, part.vertices].reshape(len(shapes), -1)
        drivers[:, part.drivers] += (along @ part.coefficients.T).reshape(len(shapes), len(part.drivers), -1)
    energy = (np.einsum("fbn,kbn->fkb", inputs, drivers) ** 2).sum(axis=0)
    drivers[energy < _SMALLEST_DRIVE * energy.max(axis=1, keepdims=True)] = 0.0
    return drivers
