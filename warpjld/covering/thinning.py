"""Sparsification of diffused fields by soft thresholding, which keeps them continuous."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.fields import Fields
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["THRESHOLD", "thinned", "thinned_slope"]

THRESHOLD = 0.01
"""Threshold by which every coefficient is shrunk towards zero. A larger one makes rows shorter and evaluation faster,
but where many fields overlap, as at a shoulder, .03 is visible: it loses a fifth of the smoothness that diffusion
gave."""


def thinned(fields: Fields) -> Fields:
    """Fields after x ← sign(x) max(|x| − ``THRESHOLD``, 0), with rows of positions and rotations renormalised to a sum
    of one."""
    return Fields(
        _summing_to_one(fields.positions),
        _summing_to_one(fields.turns),
        _shrunk(fields.roundings),
        _shrunk(fields.swellings),
        _shrunk(fields.palm),
        _shrunk(fields.muscles),
    )


def thinned_slope(turns: sp.csr_array, thin: sp.csr_array, slope: NDArray[np.float64]) -> NDArray[np.float64]:
    """Adjoint of thinning: derivatives by rotations' weights before it, from those by the weights ``thin`` after it.

    w = t / Σ t with t the shrunk weights, so dw/dt = (1 − w Σ) / Σ t where t is not zero.
    """
    left = thin.toarray()
    total = np.asarray(_shrunk(turns).sum(axis=1))[:, None]
    kept = left != 0.0
    mean = (slope * left).sum(axis=1, keepdims=True)
    return np.where(kept, (slope - mean) / total, 0.0)


def _shrunk(fields: sp.csr_array) -> sp.csr_array:
    out = fields.copy()
    out.data = np.sign(out.data) * np.maximum(np.abs(out.data) - THRESHOLD, 0.0)
    out.eliminate_zeros()
    return out


def _summing_to_one(fields: sp.csr_array) -> sp.csr_array:
    """Fields shrunk, and rows normalised to a sum of one; unchanged where some row has negligible entries only."""
    thin = _shrunk(fields)
    total = np.asarray(thin.sum(axis=1)).ravel()
    if (total < THRESHOLD).any():
        return fields
    return sp.csr_array(sp.diags_array(1.0 / total) @ thin)
