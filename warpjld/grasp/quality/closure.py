"""Force closure: whether the contacts can balance every wrench, given enough force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import WarpjldError
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.small_programs import largest_last
from warpjld.grasp.quality.wrenches import contact_wrenches, has_full_rank

__all__ = ["Closure", "closure_margins", "force_closure"]

# tolerance of the HiGHS solver; a smaller margin could be a rounding error
_MARGIN = 1e-7


@dataclass(frozen=True, eq=False)
class Closure:
    """Result of `force_closure`.

    Attributes:
        closed: Whether the grasp is force closed.
        margin: Smallest coefficient of any cone edge in the internal force, times the number of edges, from 0 (not
            closed) to 1 (all edges contribute equally).
        full_rank: Whether the wrenches span all six dimensions; if not, the contacts cannot be force closed.
        squeeze: Normal force of each contact in the internal grasp force found, summing to 1 [N], shape (C,); zeros
            without closure.
        forces: That internal force in the contacts' frames, rows (f_t₁, f_t₂, f_n, τ_n), shape (C, 4).
    """

    closed: bool
    margin: float
    full_rank: bool
    squeeze: NDArray[np.float64]
    forces: NDArray[np.float64]


def force_closure(
    contacts: Contacts, center: ArrayLike = (0.0, 0.0, 0.0), *, torque_scale: float = 1.0, edges: int = 8
) -> Closure:
    """Test whether friction cones, discretised from inside, positively span the space of wrenches.

    Force closure ⇔ the primitive wrenches w_k have rank 6 and the origin lies strictly inside their convex hull
    (Nguyen 1988, "Constructing force-closure grasps"; Murray, Li & Sastry 1994, Proposition 5.3). Strictly inside means
    a combination in which every wrench takes part, found by the linear program

        maximise t   subject to   Σ α_k w_k = 0,   Σ α_k = 1,   α_k ≥ t

    (HiGHS). Neither ``center`` nor ``torque_scale`` changes the result; they only improve the conditioning.

    Args:
        contacts: C contacts.
        center: Point torques are taken about [m].
        torque_scale: Length torques are divided by [m].
        edges: Edges of a friction cone.
    """
    none = Closure(False, 0.0, False, np.zeros(len(contacts)), np.zeros((len(contacts), 4)))
    if not len(contacts):
        return none
    blocks = contact_wrenches(contacts, center, torque_scale, edges)
    wrenches = np.concatenate(blocks, axis=1)
    if not has_full_rank(wrenches):
        return none
    shares, least = _even_combination(wrenches)
    if least * wrenches.shape[1] <= _MARGIN:
        return Closure(False, 0.0, True, none.squeeze, none.forces)
    forces = _contact_forces(contacts, shares, edges)
    return Closure(True, float(least * wrenches.shape[1]), True, forces[:, 2], forces)


def closure_margins(
    grasps: Sequence[Contacts], center: ArrayLike = (0.0, 0.0, 0.0), *, torque_scale: float = 1.0, edges: int = 8
) -> NDArray[np.float64]:
    """``margin`` of ``force_closure`` for many grasps of one object, 0 where it is not force closed, shape (G,).

    Their linear programs are solved together by a kernel (`largest_last`); the solution is then that
    of the optimal basis. Programs that it does not solve go to HiGHS.
    """
    out = np.zeros(len(grasps))
    kept, wrenches = [], []
    for g, contacts in enumerate(grasps):
        if len(contacts):
            own = np.concatenate(contact_wrenches(contacts, center, torque_scale, edges), axis=1)
            if has_full_rank(own):
                kept.append(g)
                wrenches.append(own)
    solved = largest_last([_equations(own) for own in wrenches])
    for g, own, least in zip(kept, wrenches, solved, strict=True):
        margin = own.shape[1] * (_even_combination(own)[1] if least is None else least)
        out[g] = margin if margin > _MARGIN else 0.0
    return out


def _equations(wrenches: NDArray[np.float64]) -> NDArray[np.float64]:
    """Left-hand sides (7, k + 1) of Σ α w = 0 and Σ α = 1 for β and t, where α = t + β.

    With β ≥ 0 there are bounds instead of a row for every edge.
    """
    count = wrenches.shape[1]
    equal = np.zeros((7, count + 1))
    equal[:6, :count] = wrenches
    equal[:6, count] = wrenches.sum(axis=1)
    equal[6, :count], equal[6, count] = 1.0, count
    return equal


def _even_combination(wrenches: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Solve the linear program of ``force_closure`` for wrenches (6, k): coefficients α (k,) and their minimum t."""
    from scipy.optimize import linprog

    count = wrenches.shape[1]
    equal = _equations(wrenches)
    cost = np.zeros(count + 1)
    cost[count] = -1.0
    found = linprog(cost, A_eq=equal, b_eq=np.r_[np.zeros(6), 1.0], bounds=(0.0, None), method="highs")
    if found.status == 2:  # infeasible: the origin is outside the hull
        return np.zeros(count), 0.0
    if found.status != 0:
        raise WarpjldError(f"force closure: the linear program stopped: {found.message}")
    return found.x[:count] + found.x[count], float(found.x[count])


def _contact_forces(contacts: Contacts, shares: NDArray[np.float64], edges: int) -> NDArray[np.float64]:
    """Contact forces (C, 4) from coefficients of all cone edges."""
    from warpjld.grasp.quality.cone import friction_cone

    forces, start = np.zeros((len(contacts), 4)), 0
    for i, cone in enumerate(friction_cone(contacts, edges)):
        forces[i] = cone @ shares[start : start + cone.shape[1]]
        start += cone.shape[1]
    return forces
