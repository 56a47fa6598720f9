"""Task-oriented grasp quality: the largest disturbance that a grasp resists in one given direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError, WarpjldError
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.small_programs import largest_last
from warpjld.grasp.quality.wrenches import contact_wrenches

__all__ = ["resisted_wrench", "resisted_wrenches"]


def resisted_wrench(
    contacts: Contacts,
    wrench: ArrayLike,
    center: ArrayLike = (0.0, 0.0, 0.0),
    *,
    torque_scale: float = 1.0,
    budget: float = 1.0,
    edges: int = 8,
) -> float:
    """Largest multiple of an external wrench that contact forces with a bounded sum of normal forces can balance.

    The task-oriented measure (Roa & Suárez 2015, §2.2.4; Li & Sastry 1988) for a single disturbance w, by the linear
    program

        maximise λ   subject to   Σ α_k w_k + λ w = 0,   Σ α_k ≤ budget,   α_k ≥ 0

    over the primitive wrenches w_k. With w a unit force it is the weight [N] held in that direction.

    Args:
        contacts: C contacts.
        wrench: Disturbance on the object: force, then torque/ρ about the centre [N], shape (6,).
        center: Point torques are taken about [m].
        torque_scale: Length ρ that torques are divided by [m].
        budget: Largest sum of normal forces [N].
        edges: Edges of a friction cone.

    Returns:
        λ ≥ 0; 0 where the wrench cannot be resisted at all.

    Raises:
        InputError: A wrench of another shape, zero or not finite, or a budget that is not positive.
        WarpjldError: The linear program stopped.
    """
    load = np.asarray(wrench, dtype=np.float64)
    if load.shape != (6,) or not np.isfinite(load).all() or not load.any():
        raise InputError(f"wrench: want six finite numbers that are not all zero, got {wrench!r}")
    found = resisted_wrenches(contacts, load[None], center, torque_scale=torque_scale, budget=budget, edges=edges)
    return float(found[0])


def resisted_wrenches(
    contacts: Contacts,
    loads: NDArray[np.float64],
    center: ArrayLike = (0.0, 0.0, 0.0),
    *,
    torque_scale: float = 1.0,
    budget: float = 1.0,
    edges: int = 8,
) -> NDArray[np.float64]:
    """``resisted_wrench`` for wrenches (D, 6) that are finite and not zero, shape (D,)."""
    if not (np.isfinite(budget) and budget > 0.0):
        raise InputError(f"budget: want a force > 0 [N], got {budget!r}")
    if not len(contacts):
        return np.zeros(len(loads))
    wrenches = np.concatenate(contact_wrenches(contacts, center, torque_scale, edges), axis=1)
    # in parts of the budget, of which one variable is left over
    rows = np.concatenate([np.vstack([wrenches, np.ones(wrenches.shape[1])]), np.eye(7)[:, 6:]], axis=1)
    found = largest_last([np.concatenate([rows, np.r_[load, 0.0][:, None]], axis=1) for load in loads])
    most = [
        _by_highs(wrenches, load, budget) if one is None else budget * one
        for load, one in zip(loads, found, strict=True)
    ]
    return np.array(most)


def _by_highs(wrenches: NDArray[np.float64], load: NDArray[np.float64], budget: float) -> float:
    """The linear program for primitive wrenches (6, k) by HiGHS."""
    from scipy.optimize import linprog

    count = wrenches.shape[1]
    cost = np.zeros(count + 1)
    cost[count] = -1.0
    found = linprog(
        cost,
        A_ub=np.r_[np.ones(count), 0.0][None, :],
        b_ub=[budget],
        A_eq=np.column_stack([wrenches, load]),
        b_eq=np.zeros(6),
        bounds=(0.0, None),
        method="highs",
    )
    if found.status != 0:
        raise WarpjldError(f"resisted wrench: the linear program stopped: {found.message}")
    return float(found.x[count])
