"""Elastic contacts behind friction cones: the motion in which they balance a load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.quality.contacts import Contacts

__all__ = ["BALANCED", "ContactSprings"]

Array = NDArray[np.float64]

BALANCED = 1e-5
"""Largest residual of a balance, relative to the load."""

_GRADIENT = 0.01 * BALANCED  # length of the potential's gradient, relative to the load, at which a search ends
# stiffness of a regularising spring to the ground, relative to k_n: selects the smallest of undetermined motions
_GROUND = 1e-10
_STEPS = 60  # of Newton's method; typical are 5 to 15
_DAMPED = (1e-12, 1e-3, 1e6)  # least, first and most damping, relative to the stiffness of one spring
_DESCENT = 1e-4  # least share of the decrease that the quadratic model promises


class ContactSprings:
    """Contacts as springs behind friction cones; forces scaled by K^-½, so that cones are round.

    Args:
        contacts: C contacts.
        matrix: Grasp matrix (6, 4 C).
        stiffness: k_t, k_t, k_n of a contact and 0 [N/m], shape (4,).
    """

    def __init__(self, contacts: Contacts, matrix: Array, stiffness: Array) -> None:
        count = len(contacts)
        friction, spin = contacts.friction, contacts.spin
        roots = np.tile(np.sqrt(stiffness), (count, 1))
        # (f_t/μ)² + (τ/γ)² ≤ f_n² is round where k_s = k_t (γ/μ)²
        turns = (spin > 0.0) & (friction > 0.0)
        roots[turns, 3] = roots[turns, 0] * spin[turns] / friction[turns]
        self._roots = roots
        self._slope = friction * roots[:, 2] / roots[:, 0]
        # G diag(√K), per contact (C, 6, 4)
        self._map = matrix.reshape(6, count, 4).transpose(1, 0, 2) * roots[:, None, :]

    def balance(self, preload: Array, loads: Array) -> tuple[Array, Array, Array]:
        """Motions (D, 6) [m], forces (D, C, 4) and relative residuals (D,) under loads (D, 6) [N].

        Newton's method with Levenberg's damping minimises the convex potential for all loads together; a load for
        which it does not end goes to SciPy's trust region.
        """
        potentials = _Potentials(self, preload, loads)
        x, ended = potentials.minimized()
        for d in np.flatnonzero(~ended):
            x[d] = potentials.by_trust_region(int(d))
        scaled = potentials.scaled_forces(x)[0]
        unbalanced = np.einsum("cij,dcj->di", self._map, scaled) + loads
        residual = np.linalg.norm(unbalanced, axis=1) / potentials.weights
        return x * potentials.units[:, None], scaled * self._roots, residual

    def project(self, forces: Array) -> tuple[Array, Array]:
        """Projection of scaled forces (D, C, 4) on their cones |y_t| ≤ m y_n, and its derivative (D, C, 4, 4)."""
        loads = len(forces)
        out, turned = self._projected(forces.reshape(-1, 4), np.tile(self._slope, loads))
        return out.reshape(forces.shape), turned.reshape(*forces.shape, 4)

    @staticmethod
    def _projected(forces: Array, slope: Array) -> tuple[Array, Array]:
        tangential, normal = forces[:, (0, 1, 3)], forces[:, 2]
        length = np.linalg.norm(tangential, axis=1)
        along = tangential / np.maximum(length, 1e-300)[:, None]
        sticks = (length <= slope * normal) & (normal >= 0.0)
        opens = ~sticks & (slope * length <= -normal)
        slides = ~sticks & ~opens
        share = (normal + slope * length) / (1.0 + slope**2)
        out = np.where(sticks[:, None], forces, 0.0)
        out[slides, 2] = share[slides]
        out[np.ix_(slides, (0, 1, 3))] = (slope * share)[slides, None] * along[slides]

        turned = np.zeros((len(forces), 4, 4))
        turned[sticks] = np.eye(4)
        edge = np.zeros((len(forces), 4))  # the cone's edge that a sliding force is projected on
        edge[:, (0, 1, 3)] = slope[:, None] * along
        edge[:, 2] = 1.0
        across = np.zeros((len(forces), 4, 4))
        flat = np.eye(3) - along[:, :, None] * along[:, None, :]
        across[np.ix_(range(len(forces)), (0, 1, 3), (0, 1, 3))] = flat
        turned[slides] = (
            edge[slides, :, None] * edge[slides, None, :] / (1.0 + slope[slides, None, None] ** 2)
            + (slope * share / np.maximum(length, 1e-300))[slides, None, None] * across[slides]
        )
        return out, turned


class _Potentials:
    """Convex potentials Φ(x) of all loads in scaled unknowns x = ξ/unit, shape (D, 6); see `gravity_displacement`."""

    def __init__(self, springs: ContactSprings, preload: Array, loads: Array) -> None:
        self._springs, self._loads = springs, loads
        safe = np.where(springs._roots > 0.0, springs._roots, 1.0)
        self._start = np.where(springs._roots > 0.0, preload / safe, 0.0)
        self.weights = np.linalg.norm(loads, axis=1)
        self.units = self.weights / float(springs._roots[:, 2].max() ** 2)  # deflection of one spring

    def scaled_forces(self, x: Array, rows: slice | NDArray[np.intp] = slice(None)) -> tuple[Array, Array]:
        """Admissible scaled forces (D, C, 4) of motions and their derivatives (D, C, 4, 4)."""
        moved = np.einsum("cij,di->dcj", self._springs._map, x * self.units[rows, None])
        return self._springs.project(self._start - moved)

    def evaluate(self, x: Array, rows: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Potentials (R,), gradients (R, 6) and curvatures (R, 6, 6) of some loads, relative to load and unit."""
        weights, units, loads = self.weights[rows], self.units[rows], self._loads[rows]
        scaled, turned = self.scaled_forces(x, rows)
        own = self._springs._map
        slope = -np.einsum("cij,dcj->di", own, scaled) - loads
        energy = 0.5 * (scaled**2).sum(axis=(1, 2)) / (weights * units) - (loads * x).sum(axis=1) / weights
        springs = np.einsum("cij,dcjl->dcil", own, turned)
        curvature = np.einsum("dcil,ckl->dik", springs, own) * (units / weights)[:, None, None]
        return (
            energy + 0.5 * _GROUND * (x**2).sum(axis=1),
            slope / weights[:, None] + _GROUND * x,
            curvature + _GROUND * np.eye(6),
        )

    def minimized(self) -> tuple[Array, NDArray[np.bool_]]:
        """Minimisers (D, 6), and for which loads the gradient is small enough."""
        count = len(self._loads)
        x, ended = np.zeros((count, 6)), np.zeros(count, dtype=bool)
        least, first, most = _DAMPED
        damping = np.full(count, first)
        energy, slope, curvature = self.evaluate(x, np.arange(count))
        for _ in range(_STEPS):
            ended |= np.linalg.norm(slope, axis=1) <= _GRADIENT
            rows = np.flatnonzero(~ended & (damping <= most))
            if not len(rows):
                break
            damped = curvature[rows] + damping[rows, None, None] * np.eye(6)
            step = -np.linalg.solve(damped, slope[rows, :, None])[:, :, 0]
            tried = self.evaluate(x[rows] + step, rows)
            promised = -0.5 * (slope[rows] * step).sum(axis=1)
            kept = energy[rows] - tried[0] >= _DESCENT * promised
            # near the end the decrease is lost in rounding, and the gradient tells
            kept |= np.linalg.norm(tried[1], axis=1) < 0.5 * np.linalg.norm(slope[rows], axis=1)
            damping[rows] = np.where(kept, np.maximum(0.1 * damping[rows], least), 10.0 * damping[rows])
            good = rows[kept]
            x[good] += step[kept]
            energy[good], slope[good], curvature[good] = (values[kept] for values in tried)
        return x, ended

    def by_trust_region(self, d: int) -> Array:
        """Minimiser (6,) for one load by SciPy."""
        from scipy.optimize import minimize

        rows = np.array([d])

        def evaluated(k: int, x: Array) -> Array:
            return self.evaluate(x[None], rows)[k][0]

        found = minimize(
            lambda x: (float(evaluated(0, x)), evaluated(1, x)),
            np.zeros(6),
            jac=True,
            hess=lambda x: evaluated(2, x),
            method="trust-exact",
            options={"gtol": _GRADIENT, "maxiter": 2000, "max_trust_radius": 1e6},
        )
        return np.asarray(found.x)
