"""Friction closure test: whether the contacts of hands on a free object can balance, or can only push it (R122)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.quality import Contacts, contact_wrenches

__all__ = ["friction_closure"]

_BALANCED = 1e-3
"""Tolerance of the balance: residual wrench (moments over the object's size) relative to the sum of forces."""
_MOST = 200
"""Most contact points considered, the deepest first."""


def friction_closure(
    points: NDArray[np.float64], inward: NDArray[np.float64], depth: NDArray[np.float64], friction: float
) -> bool:
    """Whether contact forces inside their friction cones can balance each other.

    Feasibility of Σ f = 0 and Σ r × f = 0 with non-negative forces along the edges of linearised friction cones, by
    non-negative least squares.

    Args:
        points: Contact points, where skin penetrates the object [m], shape (n, 3).
        inward: Unit normals into the object there, shape (n, 3).
        depth: Penetration depths [m], shape (n,).
        friction: Coulomb's μ.
    """
    from scipy.optimize import nnls

    if len(points) < 2:
        return False
    deepest = np.argsort(-depth, kind="stable")[:_MOST]
    points, inward = points[deepest], inward[deepest]
    centre = points.mean(axis=0)
    reach = max(float(np.linalg.norm(points - centre, axis=1).max()), 1e-9)
    contacts = Contacts(points, inward, np.full(len(points), friction))
    wrenches = np.concatenate(contact_wrenches(contacts, centre, reach), axis=1)
    total = np.ones(wrenches.shape[1])  # normalisation: the forces along all edges sum to 1
    residual = nnls(np.vstack([wrenches, total]), np.append(np.zeros(6), 1.0))[1]
    return bool(residual < _BALANCED)
