"""Diversity of a set of grasps: entropy of joint angles, first principal component, spread of approach directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError

__all__ = ["Diversity", "diversity"]

_BINS = 100  # bins of the histograms of joint angles


@dataclass(frozen=True)
class Diversity:
    """Result of `diversity`.

    Attributes:
        grasps: Number of grasps.
        entropy: Mean entropy of the joint angles [nat], from 0 to ln bins: larger is more diverse.
        entropy_spread: Standard deviation of the angles' entropies [nat].
        first_component: Share of the postures' variance along their first principal component, from 1 / angles to 1:
            smaller is more diverse; 1 where all are the same.
        approach_spread: 1 − length of the mean of the unit approach vectors, from 0 (all alike) to 1.
        bins: Number of bins of the histograms.
    """

    grasps: int
    entropy: float
    entropy_spread: float
    first_component: float
    approach_spread: float
    bins: int


def diversity(angles: ArrayLike, limits: ArrayLike, approaches: ArrayLike, *, bins: int = _BINS) -> Diversity:
    """Diversity of G grasps of one hand.

    With p_b the share of grasps whose angle lies in bin b of ``bins`` equal ones between the joint's limits,

        H = −Σ_b p_b ln p_b

    is the entropy of one angle; its mean over angles is DexGraspNet's measure (Wang et al. 2023, §5). With λ_k the
    eigenvalues of the covariance of the vectors of angles, λ_1 / Σ λ_k is the first component's share (as
    DexGraspBench, Chen et al. 2025). With u_g unit vectors of approach, 1 − ‖Σ u_g / G‖ is their spherical variance
    (Mardia & Jupp 2000, §9.2).

    Args:
        angles: Joint angles [rad], shape (G, A).
        limits: Their smallest and largest values [rad], shape (A, 2); values beyond count in the first or last bin.
        approaches: Directions of any length but 0, shape (G, 3).
        bins: Number of bins of the histograms.

    Raises:
        InputError: No grasp, shapes that do not fit, or an upper limit that is not above the lower one.
    """
    postures, room = np.asarray(angles, dtype=np.float64), np.asarray(limits, dtype=np.float64)
    ways = np.asarray(approaches, dtype=np.float64)
    count = len(postures)
    if postures.ndim != 2 or not count or room.shape != (postures.shape[1], 2) or ways.shape != (count, 3):
        raise InputError(
            f"diversity: want angles (G, A), limits (A, 2), approaches (G, 3), got {postures.shape}, {room.shape}, "
            f"{ways.shape}"
        )
    if not (room[:, 1] > room[:, 0]).all():
        raise InputError("diversity: an angle's limits leave no room")
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    if not (lengths > 0.0).all():
        raise InputError("diversity: an approach has no direction")
    entropies = _entropies(postures, room, bins)
    variances = np.linalg.eigvalsh(np.cov(postures.T, bias=True).reshape(postures.shape[1], -1))
    total = float(variances.clip(0.0).sum())
    first = float(variances[-1]) / total if total > 1e-18 else 1.0
    spread = 1.0 - float(np.linalg.norm((ways / lengths).mean(axis=0)))
    return Diversity(count, float(entropies.mean()), float(entropies.std()), first, max(0.0, spread), bins)


def _entropies(postures: NDArray[np.float64], room: NDArray[np.float64], bins: int) -> NDArray[np.float64]:
    share = (postures - room[:, 0]) / (room[:, 1] - room[:, 0])
    place = np.clip((share * bins).astype(np.int64), 0, bins - 1)
    out = np.zeros(postures.shape[1])
    for k in range(postures.shape[1]):
        p = np.bincount(place[:, k], minlength=bins) / len(postures)
        p = p[p > 0.0]
        out[k] = -float((p * np.log(p)).sum())
    return out
