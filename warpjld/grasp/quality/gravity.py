"""Displacement of a held object under gravity in six directions: quasi-static balance on compliant contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError, WarpjldError
from warpjld.grasp.quality.closure import Closure, force_closure
from warpjld.grasp.quality.contact_springs import BALANCED, ContactSprings
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.resistance import resisted_wrenches
from warpjld.grasp.quality.wrenches import grasp_matrix

__all__ = ["SIX_DIRECTIONS", "GravityResponse", "gravity_displacement"]

Array = NDArray[np.float64]

SIX_DIRECTIONS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
"""±x, ±y, ±z, shape (6, 3)."""


@dataclass(frozen=True, eq=False)
class GravityResponse:
    """Result of `gravity_displacement`, one entry per direction.

    Attributes:
        held: Whether the contacts can carry the weight with any forces, shape (D,).
        displacements: Displacement of the centre [m], shape (D, 3); infinite where not held.
        rotations: Small rotation vectors [rad], shape (D, 3); infinite where not held.
        forces: Contact forces in the contacts' frames (f_t₁, f_t₂, f_n, τ_n) [N, N m], shape (D, C, 4); NaN where
            not held.
        residual: Unbalanced wrench divided by the weight, after the solve, shape (D,); infinite where not held.
        lift: Multiple of the weight that the contacts hold with a total normal force of ``squeeze``, shape (D,).
    """

    held: NDArray[np.bool_]
    displacements: Array
    rotations: Array
    forces: Array
    residual: Array
    lift: Array

    @property
    def distance(self) -> Array:
        """Length of the displacement of the centre [m], shape (D,)."""
        return np.asarray(np.linalg.norm(self.displacements, axis=1))

    @property
    def worst(self) -> float:
        """Largest displacement over all directions [m]; infinite where a direction is not held."""
        return float(self.distance.max())


def gravity_displacement(
    contacts: Contacts,
    center: ArrayLike,
    *,
    mass: float,
    torque_scale: float,
    squeeze: float,
    normal_stiffness: float = 3500.0,
    tangential_stiffness: float = 2400.0,
    gravity: float = 9.81,
    directions: ArrayLike = SIX_DIRECTIONS,
    edges: int = 8,
    closure: Closure | None = None,
) -> GravityResponse:
    """Displacement of the object when gravity acts along each direction in turn, with the hand fixed.

    Every contact is a spring K = diag(k_t, k_t, k_n, k_s) of the skin behind a Coulomb cone. The object's small motion
    ξ = (v, ω) changes the forces f_i from their preload f⁰_i (Cutkosky & Kao 1989, "Computing and controlling the
    compliance of a robotic hand": G K Gᵀ is the grasp's stiffness), and they must balance the weight w:

        f_i(ξ) = Π_i( f⁰_i − K G_iᵀ ξ ),    Σ G_i f_i(ξ) + w = 0,

    Π_i the projection on the friction cone in the metric K⁻¹: it keeps a sticking contact as it is, lets a pulled one
    go and a loaded one slide. As Π_i is a gradient this is the minimum of the convex potential
    Φ(ξ) = Σ ½‖f_i(ξ)‖²_{K⁻¹} − w·ξ, that is, the least elastic energy among admissible forces in balance (complementary
    energy; Han, Trinkle & Li 2000 have the cones). The projection is exact for the round cone. It makes sliding
    associated: a sliding contact also opens by μ times its slip, which a Coulomb contact does not.

    The preload is the most even internal force that closes the grasp (`force_closure`), scaled to ``squeeze``; zero
    without closure. Without slip ξ = −(G K Gᵀ)⁻¹(−w) exactly. Where even unbounded forces in the discretised cones
    cannot carry w, the object is not held.

    ``lift`` does not depend on stiffness: it is `resisted_wrench` for the weight with a budget of ``squeeze``, the
    largest factor λ for which forces in the cones, whose normal components sum to ``squeeze`` at most, balance λ w.
    Above 1 the hand can lift the object slowly; above 1 + a/g also with acceleration a.

    Args:
        contacts: C contacts.
        center: Centre of mass [m].
        mass: Mass of the object [kg].
        torque_scale: Length [m] that converts torques to forces and rotations to lengths; for conditioning only.
        squeeze: Sum of the normal forces before gravity acts [N].
        normal_stiffness: k_n of a contact [N/m]; the default is a finger pulp's under load (reported about 3.5 N/mm).
        tangential_stiffness: k_t [N/m]; the default is k_n (2 − 2ν)/(2 − ν), ν = 0.48 (Mindlin 1949). Torsion has
            k_s = k_t (γ/μ)², 4/9 k_t a² for a patch of radius a.
        gravity: Acceleration [m/s²].
        directions: Directions gravity acts along, shape (D, 3); normalised here.
        edges: Edges of the friction cones for closure and for deciding whether the object is held.
        closure: Result of `force_closure` for the same contacts, centre, length and edges, if it is known.

    Returns:
        A response per direction.

    Raises:
        InputError: A mass, length, stiffness or acceleration that is not positive, a negative squeeze, or a
            direction without length.
        WarpjldError: The solve did not reach balance.
    """
    stiffness = np.array([tangential_stiffness, tangential_stiffness, normal_stiffness, 0.0])
    for name, value in (("mass", mass), ("normal_stiffness", normal_stiffness), ("gravity", gravity)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name}: want a number > 0, got {value!r}")
    if not (np.isfinite(tangential_stiffness) and tangential_stiffness > 0.0):
        raise InputError(f"tangential_stiffness: want a number > 0, got {tangential_stiffness!r}")
    if not (np.isfinite(squeeze) and squeeze >= 0.0):
        raise InputError(f"squeeze: want a force ≥ 0 [N], got {squeeze!r}")
    ways = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    if not (np.isfinite(ways).all() and (lengths > 0.0).all()):
        raise InputError(f"directions: want finite vectors that are not zero, got {directions!r}")
    ways = ways / lengths
    count = len(ways)
    motion = np.full((count, 6), np.inf)
    forces = np.full((count, len(contacts), 4), np.nan)
    residual = np.full(count, np.inf)
    weight = mass * gravity
    loads = weight * np.concatenate([ways, np.zeros((count, 3))], axis=1)
    reach = resisted_wrenches(contacts, loads, center, torque_scale=torque_scale, budget=1e6 * weight, edges=edges)
    # the program is homogeneous: half the forces hold half the weight
    lift = np.maximum(0.0, reach) * squeeze / (1e6 * weight)
    held = reach >= 1.0
    if held.any():
        springs = ContactSprings(contacts, grasp_matrix(contacts, center, torque_scale), stiffness)
        if closure is None:
            closure = force_closure(contacts, center, torque_scale=torque_scale, edges=edges)
        motion[held], forces[held], residual[held] = springs.balance(squeeze * closure.forces, loads[held])
    for d in np.flatnonzero(held & (residual > BALANCED)):
        raise WarpjldError(f"gravity: direction {d}: forces are unbalanced by {residual[d]:.1e} of the weight")
    return GravityResponse(held, motion[:, :3], motion[:, 3:] / torque_scale, forces, residual, lift)
