"""Chebyshev smoothing: inverted diagonal blocks, coefficients, and an estimate of the largest eigenvalue."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal

from warpjld.fem.arrays import Array, Mask, dot
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError

__all__ = ["block_inverse", "chebyshev_steps", "highest_eigenvalue"]


def block_inverse(matrix: BlockMatrix, free: Mask | None = None) -> Array:
    """Inverses of the diagonal blocks, zero for prescribed degrees of freedom or zero stiffness, shape (N, 3, 3).

    Raises:
        IndefiniteError: A diagonal block with a negative stiffness.
    """
    blocks = matrix.diagonal().astype(np.float64)
    diagonal = np.einsum("nii->ni", blocks)
    if (diagonal < 0).any():
        node, axis = np.argwhere(diagonal < 0)[0]
        raise IndefiniteError(
            f"node {node} has the negative stiffness {diagonal[node, axis]:.3g} N/m along {'xyz'[axis]}"
        )
    on = diagonal > 1e-13 * diagonal.max(initial=0.0)
    if free is not None:
        on &= free.reshape(-1, 3)
    blocks = blocks * (on[:, :, None] & on[:, None, :])
    blocks[:, [0, 1, 2], [0, 1, 2]] += ~on
    inverse: Array = np.linalg.inv(blocks)
    return inverse * (on[:, :, None] & on[:, None, :])


def chebyshev_steps(degree: int, low: float, high: float) -> list[tuple[float, float]]:
    """Momentum and scale of each step of the Chebyshev polynomial over [low, high].

    With step ← momentum · step + scale · (b − A x) and x ← x + step, from x = 0, the error component of eigenvalue λ is
    multiplied by T(c(λ)) / T(c(0)), T the Chebyshev polynomial of this degree, c(λ) = (low + high − 2λ)/(high − low).
    """
    centre, half = 0.5 * (high + low), 0.5 * (high - low)
    sigma = centre / half
    rho = 1.0 / sigma
    steps = [(0.0, 1.0 / centre)]
    for _ in range(degree - 1):
        following = 1.0 / (2.0 * sigma - rho)
        steps.append((following * rho, 2.0 * following / half))
        rho = following
    return steps


def highest_eigenvalue(matrix: BlockMatrix, inverse: NDArray[Any], threads: int, rounds: int = 16) -> float:
    """Largest eigenvalue of D⁻¹A by the Lanczos method, from the coefficients of conjugate gradients; deterministic.

    A few badly shaped elements cause a few large, isolated eigenvalues; power iteration finds them too slowly, and a
    smoother that underestimates them amplifies their modes.

    Args:
        matrix: A, symmetric positive semidefinite.
        inverse: Inverted diagonal blocks D⁻¹, shape (N, 3, 3), in the matrix's type.
        threads: Number of threads.
        rounds: Largest number of steps.
    """
    kind = matrix.values.dtype
    rng = np.random.default_rng(0)

    def scaled(v: NDArray[Any]) -> NDArray[Any]:
        return np.einsum("nij,nj->ni", inverse, v.reshape(-1, 3)).ravel()

    r = rng.uniform(-1.0, 1.0, 3 * matrix.size).astype(kind)
    z = scaled(r)
    p, rz = z, dot(r, z)
    diagonal, beside = [], []
    ratio, before = 0.0, 1.0
    for _ in range(rounds):
        q = matrix.product(p, threads=threads)
        curvature = dot(p, q)
        if not (curvature > 0.0 and rz > 0.0):
            break
        alpha = rz / curvature
        diagonal.append(1.0 / alpha + ratio / before)
        r = r - kind.type(alpha) * q
        z = scaled(r)
        ratio, rz = dot(r, z) / rz, dot(r, z)
        beside.append(np.sqrt(max(ratio, 0.0)) / alpha)
        p = z + kind.type(ratio) * p
        before = alpha
    if not diagonal:
        return 1.0
    return float(eigh_tridiagonal(np.array(diagonal), np.array(beside[:-1]), eigvals_only=True)[-1])
