"""Whether hands that touch a free object from several sides could hold it by friction, or can only push it (R122)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.quality import Contacts, contact_wrenches

__all__ = ["friction_closure"]

_BALANCED = 1e-3
"""Force and moment left over, over the forces that press."""
_MOST = 200
"""Points looked at: the deepest."""


def friction_closure(
    points: NDArray[np.float64], inward: NDArray[np.float64], depth: NDArray[np.float64], friction: float
) -> bool:
    """Whether pushes at points, each inside its friction cone, can balance each other.

    A wedge of digits pushes out what is slippery and holds what is not: forces along the edges of the cones with
    Σ f = 0 and Σ r × f = 0 exist, or they do not.

    Args:
        points: Where skin reaches into the object [m], shape (n, 3).
        inward: Unit normals into the object there, shape (n, 3).
        depth: How deep it does [m], shape (n,).
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
    some = np.ones(wrenches.shape[1])  # the forces along all edges together are one
    left = nnls(np.vstack([wrenches, some]), np.append(np.zeros(6), 1.0))[1]
    return bool(left < _BALANCED)
