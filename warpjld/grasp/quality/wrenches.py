"""Grasp matrix, and primitive wrenches: what the edges of the friction cones exert on the object."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.grasp.quality.cone import friction_cone
from warpjld.grasp.quality.contacts import Contacts

__all__ = ["contact_wrenches", "grasp_matrix", "has_full_rank"]

Array = NDArray[np.float64]

# smallest relative singular value that counts for the rank; wrenches of real grasps stay above 1e-4
_RANK = 1e-9


def grasp_matrix(contacts: Contacts, center: ArrayLike, torque_scale: float) -> Array:
    """Grasp matrix G: from contact forces to the object's wrench (Murray, Li & Sastry 1994, §5.2.2, eq. 5.6).

    Column block i, of contact i at r_i with frame R_i = (t₁ t₂ n), is

        G_i = [ R_i          0    ]
              [ [r_i − c]× R_i/ρ  n_i/ρ ]

    Args:
        contacts: C contacts.
        center: Point c that torques are taken about, usually the centre of mass [m], shape (3,).
        torque_scale: Length ρ that torques are divided by, so that wrenches have one unit [m]. Common choices: the
            largest distance of the surface from c (Roa & Suárez 2015, §2.1.2), the radius of gyration.

    Returns:
        G, shape (6, 4C); per contact the columns f_t₁, f_t₂, f_n, τ_n; rows force [N], then torque/ρ [N].

    Raises:
        InputError: A centre that is not three finite numbers, or a length that is not positive.
    """
    middle = np.asarray(center, dtype=np.float64)
    if middle.shape != (3,) or not np.isfinite(middle).all():
        raise InputError(f"center: want three finite numbers, got {center!r}")
    if not (np.isfinite(torque_scale) and torque_scale > 0.0):
        raise InputError(f"torque_scale: want a length > 0 [m], got {torque_scale!r}")
    frames = contacts.frames
    matrix = np.zeros((6, len(contacts), 4))
    matrix[:3, :, :3] = frames.transpose(1, 0, 2)
    arms = (contacts.points - middle)[:, :, None]
    matrix[3:, :, :3] = np.cross(arms, frames, axis=1).transpose(1, 0, 2) / torque_scale
    matrix[3:, :, 3] = contacts.normals.T / torque_scale
    return matrix.reshape(6, 4 * len(contacts))


def contact_wrenches(contacts: Contacts, center: ArrayLike, torque_scale: float, edges: int = 8) -> list[Array]:
    """Primitive wrenches: what each edge of each friction cone exerts, for unit normal force.

    Args:
        contacts: C contacts.
        center: As in `grasp_matrix`, likewise ``torque_scale``.
        edges: Edges of a friction cone.

    Returns:
        Per contact an array (6, k), see `friction_cone`.
    """
    matrix = grasp_matrix(contacts, center, torque_scale)
    cones = friction_cone(contacts, edges)
    return [matrix[:, 4 * i : 4 * i + 4] @ cone for i, cone in enumerate(cones)]


def has_full_rank(wrenches: Array) -> bool:
    """Whether wrenches (6, k) span all six dimensions."""
    if wrenches.shape[1] < 6:
        return False
    values = np.linalg.svd(wrenches, compute_uv=False)
    return bool(values[5] > _RANK * values[0])
