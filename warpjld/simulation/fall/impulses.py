"""Contact impulses of rigid bodies in a time step by Signorini's and Coulomb's laws (Moreau time stepping).

Moreau's time stepping (J. J. Moreau 1988, Unilateral contact and dry friction in finite freedom dynamics; M. Jean 1999,
The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng. 177, 235–257) without restitution: with u the
relative velocity at the end of a step of length h, p the impulses of it, g the gap at its beginning,

    p_n ≥ 0,   u_n + g/h ≥ 0,   p_n (u_n + g/h) = 0;
    |p_t| ≤ μ p_n,   u_t = −κ p_t with κ ≥ 0 where it slides, 0 where it sticks,

solved by projected Gauss–Seidel, contact by contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np
from numpy.typing import NDArray

from warpjld.simulation.fall.contact_points import RigidContact
from warpjld.simulation.fall.rigid_body import RigidBody

__all__ = ["impulses", "jacobian"]

_SWEEPS = 100
"""Most Gauss–Seidel sweeps."""
_EXACT = 1e-6
"""Convergence tolerance: change of impulses in a sweep relative to the largest."""


def jacobian(bodies: Sequence[RigidBody], contacts: Sequence[RigidContact]) -> NDArray[np.float64]:
    """Relative contact velocities (normal and two tangents) by velocities and spins of bodies, shape (3C, 6B)."""
    out = np.zeros((3 * len(contacts), 6 * len(bodies)))
    for k, one in enumerate(contacts):
        axes = one.axes
        for number, sign in ((one.body, 1.0), (one.other, -1.0)):
            if number >= 0:
                arm = one.point - bodies[number].centre
                out[3 * k : 3 * k + 3, 6 * number : 6 * number + 3] = sign * axes
                out[3 * k : 3 * k + 3, 6 * number + 3 : 6 * number + 6] = sign * np.cross(arm, axes)
    return out


def impulses(
    delassus: NDArray[np.float64], free: NDArray[np.float64], bounds: NDArray[np.float64], friction: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Impulses of C contacts by projected Gauss–Seidel [N s], shape (3C,): normal and two tangents of each.

    Args:
        delassus: Delassus operator: relative velocities by impulses [1/kg], shape (3C, 3C).
        free: Relative velocities without contact impulses [m/s], shape (3C,).
        bounds: g/h: largest closing velocity of each contact [m/s], shape (C,).
        friction: Coulomb's μ, shape (C,).
    """
    out = np.zeros(len(free))
    stiff = (np.diag(delassus) + 1e-300).tolist()
    tangent = [max(stiff[i + 1], stiff[i + 2]) for i in range(0, len(stiff), 3)]
    rows = list(delassus)
    for _ in range(_SWEEPS):
        change = 0.0
        for k in range(len(bounds)):
            i = 3 * k
            old = out[i]
            out[i] = max(0.0, old - (float(rows[i] @ out) + free[i] + bounds[k]) / stiff[i])
            change = max(change, abs(out[i] - old))
            if friction[k] <= 0.0 or (out[i] == 0.0 and old == 0.0):
                continue
            first, second = out[i + 1], out[i + 2]
            one = first - (float(rows[i + 1] @ out) + free[i + 1]) / tangent[k]
            two = second - (float(rows[i + 2] @ out) + free[i + 2]) / tangent[k]
            size, most = hypot(one, two), friction[k] * out[i]
            share = 1.0 if size <= most else most / size
            out[i + 1], out[i + 2] = share * one, share * two
            change = max(change, abs(out[i + 1] - first), abs(out[i + 2] - second))
        if change <= _EXACT * float(out[::3].max(initial=0.0)):
            break
    return out
