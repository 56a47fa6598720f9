"""Linearised friction cones: the forces and torques that a contact can transmit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.quality.contacts import Contacts

__all__ = ["friction_cone"]


def friction_cone(contacts: Contacts, edges: int = 8) -> list[NDArray[np.float64]]:
    """Edges of every contact's friction cone, for unit normal force.

    A point contact passes forces with f_t ≤ μ f_n (Murray, Li & Sastry 1994, §5.2.1). Its cone is replaced by the
    pyramid of ``edges`` edges inscribed in it,

        f_k = n + μ (cos θ_k t₁ + sin θ_k t₂),   θ_k = 2πk/edges,

    so the discretisation never overestimates a grasp; its error falls with edges⁻². A soft finger also transmits a
    torque about its normal, within the ellipsoid (f_t/μ)² + (τ_n/γ)² ≤ f_n² (Howe & Cutkosky 1996), whose two poles
    τ_n = ±γ are added to the edges above.

    Args:
        contacts: C contacts.
        edges: Edges of a cone, 3 or more.

    Returns:
        Per contact an array (4, k) of columns (f_t₁, f_t₂, f_n, τ_n) in the contact's own frame; k is ``edges`` for
        a point contact with friction, 1 for a frictionless one, and 2 more for a soft finger.

    Raises:
        InputError: Fewer than three edges.
    """
    if edges < 3:
        raise InputError(f"edges: a friction cone needs 3 or more, got {edges}")
    angles = 2.0 * np.pi * np.arange(edges) / edges
    ring = np.stack([np.cos(angles), np.sin(angles), np.ones(edges), np.zeros(edges)])
    cones = []
    for friction, spin in zip(contacts.friction.tolist(), contacts.spin.tolist(), strict=True):
        columns = []
        if friction > 0.0:
            columns.append(ring * [[friction], [friction], [1.0], [1.0]])
        if spin > 0.0:
            columns.append(np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [spin, -spin]]))
        elif friction == 0.0:
            columns.append(np.array([[0.0], [0.0], [1.0], [0.0]]))
        cones.append(np.concatenate(columns, axis=1) if len(columns) > 1 else columns[0])
    return cones
