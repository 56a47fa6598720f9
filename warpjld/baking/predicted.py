"""The residual of blend skinning, predicted from joint rotations: for each part of the skin from what deforms it.

A part is the skin of one bone: all vertices that follow it, with their skin weights. A body has a hundred joints and a
few hundred poses to learn from, too few for one regression over all joints: chance would let a finger drive the belly.
Poses in which a single bone turns show which parts it deforms; only those bones drive a part. Where a bone never turns
alone, it is taken to deform every part. At every vertex the predictions of its bones are averaged by its skin weights,
so that they are as smooth as the skin.

Each regression is a ridge regression; its strength is the one with the least leave-one-out error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

__all__ = ["PredictedSkin", "Prediction", "deforming_bones", "predicted_errors"]

_RIDGES = 10.0 ** np.arange(-6.0, 1.1, 0.5)  # strengths tried, relative to the features' mean square
_DEFORMS = 1e-2  # a bone deforms a part that, alone, it gives this share of the strongest's energy (a tenth of its RMS)
_STILL = 1e-6  # |x, y, z| of a rotation below which a bone does not turn


@dataclass(frozen=True, eq=False)
class PredictedSkin:
    """The prediction for the skin of one bone.

    Attributes:
        vertices: Its vertices, shape (n,).
        drivers: The bones that deform it, shape (m,).
        coefficients: Displacements per unit of each feature [m], times the skin weights, shape (N m, 3 n).
    """

    vertices: NDArray[np.int64]
    drivers: NDArray[np.int64]
    coefficients: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted errors.

    Attributes:
        errors: Displacements in the bind pose [m], shape (F, V, 3).
        parts: The parts that add up to them.
    """

    errors: NDArray[np.float32]
    parts: tuple[PredictedSkin, ...]


def predicted_errors(errors: NDArray[np.float32], inputs: NDArray[np.float64], skin: csc_array) -> Prediction:
    """Predict errors from features of joint rotations.

    Args:
        errors: Displacements in the bind pose [m], shape (F, V, 3).
        inputs: Features of every bone's rotation, the first three x, y, z, shape (F, B, N).
        skin: Weight of every bone at every vertex, shape (V, B).
    """
    frames = len(errors)
    deforms = deforming_bones(errors, inputs, skin)
    out = np.zeros(errors.shape, dtype=np.float32)
    parts = []
    for bone in range(skin.shape[1]):
        column = slice(skin.indptr[bone], skin.indptr[bone + 1])
        vertices, share = skin.indices[column].astype(np.int64), skin.data[column]
        drivers = np.flatnonzero(deforms[:, bone])
        if not len(vertices) or not len(drivers):
            continue
        known = inputs[:, drivers].reshape(frames, -1)
        rows = errors[:, vertices].reshape(frames, -1)
        coefficients = _ridge(known, rows, np.repeat(share, 3)).astype(np.float32)
        out[:, vertices] += (known.astype(np.float32) @ coefficients).reshape(frames, -1, 3)
        parts.append(PredictedSkin(vertices, drivers, coefficients))
    return Prediction(out, tuple(parts))


def deforming_bones(errors: NDArray[np.float32], inputs: NDArray[np.float64], skin: csc_array) -> NDArray[np.bool_]:
    """Whether each bone deforms the skin of each, shape (B, B): [driver, part]; arguments as in
    ``predicted_errors``."""
    turns = np.linalg.norm(inputs[..., :3], axis=-1) > _STILL
    alone = turns & (turns.sum(axis=1, keepdims=True) == 1)
    energy = np.einsum("fvi,fvi->fv", errors, errors).astype(np.float64) @ skin
    cases = alone.sum(axis=0)
    caused = (alone.T @ energy) / np.maximum(cases, 1)[:, None]
    strong = (caused > 0.0) & (caused >= _DEFORMS * caused.max(axis=0))
    return np.asarray((strong | (cases == 0)[:, None]) & turns.any(axis=0)[:, None])


def _ridge(known: NDArray[np.float64], rows: NDArray[np.float32], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (p, n) of a ridge regression of rows (F, n) on known features (F, p), times ``share`` (n,), which
    also weighs the columns in the choice of its strength."""
    left, values, right = np.linalg.svd(known, full_matrices=False)
    along = left.T.astype(np.float32) @ rows
    weighted = along * share.astype(np.float32)
    square = (rows**2 @ share).astype(np.float64)
    mixed = (rows @ weighted.T).astype(np.float64)
    inner = (along @ weighted.T).astype(np.float64)

    def left_out(ridge: float) -> float:
        """Sum of squares where every frame is predicted from the others."""
        hat = left * (values**2 / (values**2 + ridge))
        within = np.einsum("fp,fp->f", hat, left)
        off = square - 2.0 * np.einsum("fp,fp->f", hat, mixed) + np.einsum("fp,fp->f", hat @ inner, hat)
        return float((off / np.maximum(1.0 - within, 1e-6) ** 2).sum())

    scale = float((values**2).sum()) / len(known)
    ridge = min(_RIDGES * scale, key=left_out)
    return np.asarray((right.T * (values / (values**2 + ridge))) @ weighted)
