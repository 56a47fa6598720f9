"""Terms of an interface's active points in the linear system of the sensitivity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, coo_array, csr_array, diags_array, vstack

from warpjld.fem.arrays import Array, Ints, Mask
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints, tangential
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.results.contact_solution import LastStep
from warpjld.fem.contact.sensitivity.obstacle_slopes import ObstacleSlopes, obstacle_slopes
from warpjld.fem.contact.sensitivity.perturbation import ObstacleTwist
from warpjld.fem.contact.solver.facet_pairs import FacetPairs
from warpjld.fem.contact.solver.tangent import block_table, inner_rows
from warpjld.geometry.rotations import unit

__all__ = ["InterfaceSlopes", "interface_slopes"]

_LEAST_SLIP = 1e-7
"""Lower bound on the slip, in element edges, in the derivative of the slip direction, which is singular at zero
slip."""


@dataclass(frozen=True, eq=False)
class InterfaceSlopes:
    """Active points (k) of an interface, with sparse derivatives by the displacement u (3N,).

    Attributes:
        sites: Sites of the points, shape (k,).
        weights: W, ``csr_array`` (k, N).
        scale: Tributary area A between two meshes, where multipliers are pressures [m²]; 1 against an obstacle, where
            they are forces, so that the changing area drops out. Shape (k,).
        normal: n, shape (k, 3).
        press: Normal multiplier p [Pa or N], shape (k,).
        rub: Friction q [Pa or N], shape (k, 3).
        slip: r = W (u − u₀) − carried, before projection onto the tangent plane [m], shape (k, 3).
        sticks, slides: Masks, shape (k,); friction is constant at points with neither.
        friction: μ.
        edge: Element edge [m], shape (k,).
        by_normal: ∂n/∂u, (3k, 3N).
        by_gap: ∂g/∂u, (k, 3N).
        by_slip: ∂r/∂u, (3k, 3N).
        by_weights: Derivative of nodal forces through weights and areas [N/m], (3N, 3N); None against an obstacle.
        obstacle: Spatial derivatives of the obstacle; None between two meshes.
        points: Positions of the points [m], shape (k, 3).
    """

    sites: Ints
    weights: Any
    scale: Array
    normal: Array
    press: Array
    rub: Array
    slip: Array
    sticks: Mask
    slides: Mask
    friction: float
    edge: Array
    by_normal: Any
    by_gap: Any
    by_slip: Any
    by_weights: Any
    obstacle: ObstacleSlopes | None
    points: Array

    @cached_property
    def spreading(self) -> Any:
        """Matrix from tractions or forces of the points (3k) to nodal forces (3N)."""
        return csr_array(block_table(self.weights.T @ diags_array(self.scale)))

    @cached_property
    def plane(self) -> Array:
        """Tangent bases T of the sticking points, shape (j, 3, 2)."""
        n = self.normal[self.sticks]
        least = np.eye(3)[np.abs(n).argmin(axis=1)]
        first = unit(np.cross(n, least))
        return np.stack([first, np.cross(n, first)], axis=2)

    @cached_property
    def path(self) -> Array:
        """Friction directions t of the sliding points, zero elsewhere, shape (k, 3)."""
        return np.where(self.slides[:, None], unit(self.rub), 0.0)

    def pulled(self, relative: Any, normal: Any) -> Any:
        """Change of the tangential slip s from changes of r and n: matrices (3k, …), or vectors (3k,)."""
        n, r = self.normal, self.slip
        along = np.einsum("ki,ki->k", n, r)
        across = np.eye(3) - n[:, :, None] * n[:, None, :]
        turning = n[:, :, None] * r[:, None, :] + along[:, None, None] * np.eye(3)
        return _diagonal(across) @ relative - _diagonal(turning) @ normal

    @cached_property
    def by_tangential(self) -> Any:
        """∂s/∂u, (3k, 3N)."""
        return csr_array(self.pulled(self.by_slip, self.by_normal))

    def traction(self, slip: Any, normal: Any) -> Any:
        """Change of τ = q − p n at constant multipliers from changes of s and n: matrices (3k, …) or vectors (3k,)."""
        stick = np.where(self.sticks[:, None, None], self.normal[:, :, None] * self.rub[:, None, :], 0.0)
        turning = self.press[:, None, None] * np.eye(3) + stick
        far = np.maximum(np.linalg.norm(tangential(self.slip, self.normal), axis=1), _LEAST_SLIP * self.edge)
        beside = np.eye(3) - self.path[:, :, None] * self.path[:, None, :]
        resisting = np.where(self.slides, self.friction * self.press / far, 0.0)[:, None, None] * beside
        return -(_diagonal(turning) @ normal) - _diagonal(resisting) @ slip

    @cached_property
    def by_traction(self) -> Any:
        """∂τ/∂u at constant multipliers, (3k, 3N)."""
        return csr_array(self.traction(self.by_tangential, self.by_normal))

    @cached_property
    def by_force(self) -> Any:
        """F_u [N/m], (3N, 3N)."""
        out = self.spreading @ self.by_traction
        return csr_array(out if self.by_weights is None else out + self.by_weights)

    @cached_property
    def of_multipliers(self) -> Any:
        """∂τ/∂λ: by p of all points, then by η of the sticking ones, (3k, k + 2j)."""
        count, stuck = len(self.sites), np.flatnonzero(self.sticks)
        pressing = inner_rows(-self.normal + self.friction * self.path).T
        row = (3 * stuck[:, None, None] + np.arange(3)[None, :, None]).repeat(2, axis=2)
        column = (2 * np.arange(len(stuck))[:, None, None] + np.arange(2)[None, None, :]).repeat(3, axis=1)
        places = (row.ravel(), column.ravel())
        holding = coo_array((self.plane.ravel(), places), shape=(3 * count, 2 * len(stuck)))
        return csr_array(vstack([pressing.T, csr_array(holding).T]).T)

    @cached_property
    def constraints(self) -> Any:
        """Constraint Jacobian C, (k + 2j, 3N)."""
        return csr_array(vstack([self.by_gap, self._held(self.by_tangential)], format="csr"))

    def _held(self, slip: Any) -> Any:
        """Tᵀ at the sticking points, applied to matrices (3k, …) or vectors (3k,)."""
        count = len(self.sites)
        return csr_array(self.of_multipliers[:, count:]).T @ slip

    def moved(self, twist: ObstacleTwist) -> tuple[Array, Array]:
        """Partial derivatives of τ (3k,) and of the constraints (k + 2j,) by an obstacle's motion."""
        assert self.obstacle is not None
        v, out = twist.at(self.points), self.obstacle
        turned = np.cross(twist.turn, -self.normal) - np.einsum("kij,kj->ki", out.normal, v)
        relative = np.einsum("kij,kj->ki", out.carried, v) - v
        normal = -turned.ravel()
        slip = self.pulled(relative.ravel(), normal)
        gap = -np.einsum("ki,ki->k", out.distance, v)
        return np.asarray(self.traction(slip, normal)), np.concatenate([gap, self._held(slip)])

    def rubbed(self) -> Array:
        """∂τ/∂μ, shape (3k,)."""
        return (self.press[:, None] * self.path).ravel()


def interface_slopes(
    interface: Interface, state: ContactState, step: LastStep, number: int, u: Array, rest: Array, time: float
) -> InterfaceSlopes:
    """Terms of an interface at an equilibrium.

    Args:
        interface: The interface.
        state: Its contact state at the equilibrium.
        step: The last load step.
        number: Index of the interface.
        u: Displacement at the equilibrium [m], shape (N, 3).
        rest: Rest positions [m], shape (N, 3).
        time: Time of the equilibrium.
    """
    x = rest + u
    points = interface.points(x, step.time, time)
    at = points.sites
    active: Mask = state.bonded[at] | (state.pressure[at] > 0.0)
    rows = np.flatnonzero(active)
    if interface.mortar is None:
        by_normal, by_gap, by_slip, slopes = _by_obstacle(interface, points, rows, x, step.time, time)
        by_weights, scale = None, np.ones(len(rows))
    else:
        tractions = state.friction[at] - state.pressure[at][:, None] * points.normal
        tractions = np.where(active[:, None], tractions, 0.0)
        by_normal, by_gap, by_slip, by_weights = _by_mortar(
            interface, points, rows, tractions, x, u - step.displacement
        )
        slopes, scale = None, points.area[rows]
    # forces are the multipliers times the areas that the solver used last
    force = (step.areas[number][at[rows]] if slopes is not None else np.ones(len(rows)))[:, None]
    normal, rub = points.normal[rows], tangential(state.friction[at[rows]], points.normal[rows])
    held, bonded = state.sticking[at[rows]], state.bonded[at[rows]]
    sticks = bonded | (held & ~_drifting(state, at[rows]))
    rough = interface.pair.friction > 0.0 or bool(state.bonded.any())
    slides = ~held & ~bonded & (np.linalg.norm(rub, axis=1) > 0.0) & rough
    return InterfaceSlopes(
        sites=at[rows],
        weights=points.weights[rows],
        scale=scale,
        normal=normal,
        press=force[:, 0] * state.pressure[at[rows]],
        rub=force * rub,
        slip=step.slips[number][at[rows]],
        sticks=sticks & rough,
        slides=slides,
        friction=interface.pair.friction,
        edge=interface.edge[at[rows]],
        by_normal=by_normal,
        by_gap=by_gap,
        by_slip=by_slip,
        by_weights=by_weights,
        obstacle=slopes,
        points=points.weights[rows] @ x,
    )


def _drifting(state: ContactState, at: Ints) -> Mask:
    """Mask of the sites at (k,) that slid freely in the last step until they touched, at a time that is not known.

    They stick at the place where the solve found them first, which moves with the parameters as if nothing held them;
    their friction hardly changes. Where an interface has no other site that sticks they hold, since a body that hangs
    on them would have no derivative.
    """
    drifting = state.open_before[at] & (state.touched_at[at] == 1.0) & state.sticking[at]
    return drifting & bool((state.sticking[at] & ~drifting).any())


def _by_obstacle(
    interface: Interface, points: ContactPoints, rows: Ints, x: Array, before: float, time: float
) -> tuple[Any, Any, Any, ObstacleSlopes]:
    """∂n/∂u, ∂g/∂u, ∂r/∂u of active points against an obstacle, and the obstacle's spatial derivatives."""
    master = interface.pair.master
    assert isinstance(master, Obstacle)
    weights = points.weights[rows]
    slopes = obstacle_slopes(master, weights @ x, before, time, interface.edge[points.sites[rows]])
    table = block_table(weights)
    normal, gap = -(_diagonal(slopes.normal) @ table), inner_rows(slopes.distance) @ table
    return csr_array(normal), csr_array(gap), csr_array(table - _diagonal(slopes.carried) @ table), slopes


def _by_mortar(
    interface: Interface, points: ContactPoints, rows: Ints, tractions: Array, x: Array, moved: Array
) -> tuple[Any, Any, Any, Any]:
    """∂n/∂u, ∂g/∂u, ∂r/∂u of active points between two meshes, and derivatives of nodal forces through weights."""
    mortar = interface.mortar
    assert mortar is not None
    count = len(points.sites)
    pairs = FacetPairs(mortar, points, rows, x, interface.reach)
    turning = pairs.normals(np.ones(len(points.sites), dtype=bool))
    table = block_table(points.weights)
    apart = points.weights @ x
    gap = pairs.gaps(apart) - inner_rows(points.normal) @ table
    slip = table + _weights_by(pairs, points, moved)
    three = (3 * rows[:, None] + np.arange(3)).ravel()
    assert gap.shape[0] == count
    return turning[three], csr_array(gap)[rows], csr_array(slip)[three], pairs.forces(tractions)


def _weights_by(pairs: FacetPairs, points: ContactPoints, field: Array) -> Any:
    """Derivative of W f through the weights, for a constant vector field f (N, 3), ``csr_array`` (3m, 3N)."""
    value = points.weights @ field
    at, corner = field[pairs.column[:, ::3] // 3], pairs.corner
    spread = np.einsum("pkab,pbi->pkai", pairs.own, at[:, :4]) - np.einsum("pkab,pbi->pkai", pairs.far, at[:, 4:])
    wider = pairs.own.sum(axis=3)
    slope = (spread - value[corner][:, None] * wider[..., None]) / points.area[corner][:, None, :, None]
    known = np.broadcast_to((corner >= 0)[:, None, :, None], slope.shape)
    row = np.broadcast_to(3 * corner[:, None, :, None] + np.arange(3), slope.shape)
    column = np.broadcast_to(pairs.column[:, :, None, None], slope.shape)
    shape = (3 * len(points.sites), field.size)
    return csr_array(coo_array((slope[known], (row[known], column[known])), shape=shape))


def _diagonal(blocks: Array) -> Any:
    """Block-diagonal matrix of blocks (k, 3, 3), (3k, 3k)."""
    count = len(blocks)
    table = (np.ascontiguousarray(blocks), np.arange(count), np.arange(count + 1))
    return csr_array(bsr_array(table, shape=(3 * count, 3 * count)))
