"""Warning about rotations, which Hooke's law at small strain treats as strain."""

from __future__ import annotations

import warnings

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.material.materials import NEO_HOOKE, MaterialWarning
from warpjld.fem.mesh.shape import CENTRE_GRADIENT

__all__ = ["warn_of_rotation"]

_MOST = 0.15
"""Largest rotation without a warning [rad]: it causes spurious strains of 1 − cos = 1 %."""
_SHARE = 0.9
"""Share of a region's volume that has to rotate by more than that for a warning."""


def warn_of_rotation(body: Body, displacement: Array) -> None:
    """Warn of regions with a linear law that rotate nearly as a whole: a block rotated by 30° would grow by a third.

    The rotation of an element is the norm of (∇u − ∇uᵀ) / 2, the sine of the angle for a rigid rotation.

    Args:
        body: Mesh and laws.
        displacement: [m], shape (N, 3) or (3N,).
    """
    linear = body.kinds < NEO_HOOKE
    if not linear.any():
        return
    elements = body.mesh.elements[linear]
    x, u = body.mesh.nodes[elements], displacement.reshape(-1, 3)[elements]
    jacobian = np.einsum("eai,aj->eij", x, CENTRE_GRADIENT)
    slope = np.einsum("eai,aj->eij", u, CENTRE_GRADIENT) @ np.linalg.inv(jacobian)
    turn = np.linalg.norm(0.5 * (slope - slope.transpose(0, 2, 1)), axis=(1, 2)) / np.sqrt(2.0)
    volume, region = np.abs(np.linalg.det(jacobian)), body.mesh.regions[linear]
    for number in np.unique(region):
        mine = np.flatnonzero(region == number)
        order = mine[np.argsort(turn[mine], kind="stable")]
        share = np.cumsum(volume[order]) / volume[order].sum()
        least = float(turn[order[int(np.searchsorted(share, 1.0 - _SHARE))]])
        if least > _MOST:
            angle = np.degrees(np.arcsin(min(least, 1.0)))
            warnings.warn(
                f"'{body.mesh.region_names[number]}' rotates by about {angle:.0f}°, which its linear law treats "
                "as strain: dimensions and forces are wrong; use a large-strain law (NeoHooke)",
                MaterialWarning,
                stacklevel=3,
            )
