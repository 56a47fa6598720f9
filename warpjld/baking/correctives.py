"""Corrective shapes: the residual of blend skinning as a few shapes that joint rotations drive.

The error of blend skinning at frame f is mapped back to the bind pose by the inverse of each vertex's blended matrix,
since engines add shapes before they skin. Every bone's rotation relative to its parent, a quaternion x, y, z, w with
w ≥ 0, gives nine features: x, y, z, x², y², z², xy, xz, yz. A ridge regression predicts the errors from them; its
strength is the one with the least leave-one-out error. The K directions of largest variance of the prediction are the
shapes (reduced-rank regression: Izenman 1975), so that they contain what joint rotations predict, not the errors of
single poses.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Correctives", "features", "fit_correctives", "no_correctives"]

_RIDGES = 10.0 ** np.arange(-6.0, 1.1, 0.5)  # strengths tried, relative to the features' mean square
_DAMPING = 1e-2  # damping of inverses of nearly singular blended matrices (candy-wrapper artefacts)
_SMALLEST_DRIVE = 0.01  # share of the strongest joint's contribution below which a joint's features are left out
_PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class Correctives:
    """K shapes and the linear functions of joint rotations that drive them.

    Attributes:
        shapes: Displacements in the bind pose [m], shape (K, V, 3).
        drivers: Coefficient of every feature of every bone in a shape's weight, shape (K, B, 9).
        ridge: Strength of the ridge regression chosen.
        span: Smallest and largest weight over the poses fitted to, zero included, shape (K, 2).
    """

    shapes: NDArray[np.float64]
    drivers: NDArray[np.float64]
    ridge: float = 0.0
    span: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))

    def __len__(self) -> int:
        return len(self.shapes)

    def weights(self, turns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights of the shapes, shape (F, K), from rotations of bones relative to their parents (F, B, 4)."""
        return np.einsum("fbn,kbn->fk", features(turns), self.drivers, optimize=True)


def no_correctives(vertices: int, bones: int) -> Correctives:
    """An empty set of shapes."""
    return Correctives(np.zeros((0, vertices, 3)), np.zeros((0, bones, 9)))


def features(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Features x, y, z, x², y², z², xy, xz, yz of quaternions (F, B, 4), shape (F, B, 9)."""
    vector = turns[..., :3]
    return np.concatenate([vector, np.stack([vector[..., a] * vector[..., b] for a, b in _PRODUCTS], -1)], -1)


def fit_correctives(
    errors: NDArray[np.float64], blended: NDArray[np.float64], turns: NDArray[np.float64], count: int
) -> Correctives:
    """Fit K = ``count`` shapes to the residual of blend skinning in F frames.

    Args:
        errors: Target minus skinned position [m], shape (F, V, 3).
        blended: Linear part of every vertex's blended transform, shape (F, V, 3, 3).
        turns: Rotations of the bones relative to their parents, shape (F, B, 4).
        count: Number of shapes, at most F.
    """
    vertices = errors.shape[1]
    normal = np.einsum("fvji,fvjk->fvik", blended, blended) + _DAMPING * np.eye(3)
    right = np.einsum("fvji,fvj->fvi", blended, errors)
    back = np.linalg.solve(normal, right[..., None])[..., 0] * (1.0 + _DAMPING)
    rows = back.reshape(len(back), -1)
    between = rows @ rows.T
    inputs = features(turns)
    first = _reduced(rows, between, inputs, count)
    # joints that hardly drive the K shapes must not disturb them: repeat the regression without their features
    contribution = np.einsum("fbn,kbn->fbk", inputs, first.drivers) * np.linalg.norm(first.shapes, axis=1)
    share = (contribution**2).sum(axis=(0, 2))
    inputs[:, share < _SMALLEST_DRIVE * share.max()] = 0.0
    found = _reduced(rows, between, inputs, count)
    return Correctives(found.shapes.reshape(-1, vertices, 3), found.drivers, found.ridge, found.span)


def _reduced(
    rows: NDArray[np.float64], between: NDArray[np.float64], by_bone: NDArray[np.float64], count: int
) -> Correctives:
    """Reduced-rank ridge regression.

    Args:
        rows: Errors, shape (F, 3 V).
        between: Their Gram matrix, shape (F, F).
        by_bone: Features, shape (F, B, 9).
        count: Largest rank K.

    Returns:
        Shapes, flattened to (K, 3 V), and their drivers.
    """
    frames = len(rows)
    inputs = by_bone.reshape(frames, -1)
    left, values, right_vectors = np.linalg.svd(inputs, full_matrices=False)
    scale = float((values**2).sum()) / frames
    ridge = min(_RIDGES * scale, key=lambda r: _left_out(left, values, r, between))
    shrink = values / (values**2 + ridge)
    hat = (left * (values * shrink)) @ left.T
    spread, directions = np.linalg.eigh(hat @ between @ hat)
    kept = np.argsort(-spread)[:count]
    kept = kept[spread[kept] > 1e-12 * max(float(spread.max()), 1e-300)]
    length = np.sqrt(spread[kept])
    shapes = ((hat @ directions[:, kept]) / length).T @ rows
    drivers = ((right_vectors.T * shrink) @ (left.T @ (rows @ shapes.T))).T
    drivers[:, ~inputs.any(axis=0)] = 0.0  # else rounding errors of what never moves, as of roots
    weights = inputs @ drivers.T
    span = np.column_stack([np.minimum(weights.min(axis=0), 0.0), np.maximum(weights.max(axis=0), 0.0)])
    return Correctives(shapes, drivers.reshape(len(kept), *by_bone.shape[1:]), float(ridge), span)


def _left_out(
    left: NDArray[np.float64], values: NDArray[np.float64], ridge: float, between: NDArray[np.float64]
) -> float:
    """Leave-one-out error: sum of squares where every frame is predicted from the others.

    Args:
        left: Left singular vectors of the features.
        values: Their singular values.
        ridge: Strength of the regression.
        between: Gram matrix of the errors, shape (F, F).
    """
    hat = (left * (values**2 / (values**2 + ridge))) @ left.T
    away = (np.eye(len(hat)) - hat) / np.maximum(1.0 - np.diag(hat), 1e-6)[:, None]
    return float(np.einsum("ij,jk,ik->", away, between, away, optimize=True))
