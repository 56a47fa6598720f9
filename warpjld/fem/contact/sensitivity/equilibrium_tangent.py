"""Tangent of a contact equilibrium: its linear system, factorised once, solved for any number of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, onenormest, splu

from warpjld.errors import InputError, WarpjldError
from warpjld.fem.arrays import Array, Ints, Ints32, norm
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import interfaces_of
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.results.contact_solution import ContactSolution
from warpjld.fem.contact.sensitivity.interface_slopes import InterfaceSlopes, interface_slopes
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.runtime.threads import one_blas_thread

__all__ = ["EquilibriumTangent", "Response", "SensitivityError"]

_STIFF = 100.0
"""Penalty E over the stiffness of a point's nodes."""
_STEADY = 1e-6
"""Stabilising stiffness (``steadied``), over that of the nodes."""
_NONE = "the equilibrium has no derivative"
"""Beginning of error messages."""
_SINGULAR = 1e13
"""Condition number above which a body counts as free to move."""
_FAR = 1e-7
"""Largest nodal displacement in the finite difference of normal forces on nodes [m]."""
_ROUNDS, _EXACT = 60, 1e-9
"""Most multiplier updates, and their tolerance: violation of the constraints relative to the largest so far."""


class SensitivityError(WarpjldError):
    """The equilibrium has no derivative: a body is free to move, or the tangent is singular."""


@dataclass(frozen=True, eq=False)
class Response:
    """Derivatives of an equilibrium with respect to one parameter, per unit of it.

    Attributes:
        displacement: Of the displacements of all nodes [m], shape (N, 3).
        reactions: Of the reactions at prescribed degrees of freedom [N], zero elsewhere, shape (N, 3).
        nodal: Of the contact forces of each pair on all nodes [N], shape (P, N, 3).
        sites: Active sites of each pair.
        pressing: Of the normal multipliers there: pressures [Pa] between two meshes, forces [N] against an obstacle.
    """

    displacement: Array
    reactions: Array
    nodal: Array
    sites: tuple[Ints, ...]
    pressing: tuple[Array, ...]


class EquilibriumTangent:
    """Linear system (7) of the last equilibrium of a solution.

    Args:
        body: All bodies, merged, as solved.
        pairs: Contact pairs, as solved.
        solution: Solution whose last instant is differentiated, with the load step that found it.
        prescribed: Prescribed degrees of freedom there, shape (n,).
        steadied: Whether to add a stiffness of 1e-6 of the nodes' own, so that forces are determined although the
            position of a free body is not.

    Raises:
        InputError: A solution without its last step, or of other bodies.
        SensitivityError: The equilibrium has no derivative.
    """

    def __init__(
        self,
        body: Body,
        pairs: Sequence[Pair],
        solution: ContactSolution,
        prescribed: Ints,
        *,
        steadied: bool = False,
    ) -> None:
        last = solution.last_step
        if last is None:
            raise InputError("solution: want one that was solved here, not one that was read from a state")
        if len(solution.states) != len(pairs) or solution.last.displacement.size != body.degrees:
            raise InputError("solution: want one of this body and these pairs")
        self._body, self._u = body, solution.last.displacement
        self._interfaces = interfaces_of(body.mesh, list(pairs), body.threads) if pairs else []
        self._times = last.time, solution.last.time
        rest, time = body.mesh.nodes, solution.last.time
        known = zip(self._interfaces, solution.states, strict=True)
        self.interfaces: list[InterfaceSlopes] = [
            interface_slopes(one, state, last, k, self._u, rest, time) for k, (one, state) in enumerate(known)
        ]
        self.free = np.ones(body.degrees, dtype=bool)
        self.free[prescribed] = False
        elastic = Elastic(body)
        stiffness = elastic.at(self._u.reshape(-1), None, solution.loads).stiffness
        assert stiffness is not None
        self._stiffness = csr_array(stiffness.to_scipy().tocsr())
        if steadied:
            self._stiffness = self._stiffness + diags_array(_STEADY * np.repeat(elastic.stiffness, 3))
        for one in self.interfaces:
            self._stiffness = self._stiffness - one.by_force
        self._pushing = [csr_array(one.spreading @ one.of_multipliers) for one in self.interfaces]
        self._holding = [_holding(one, elastic.stiffness) for one in self.interfaces]
        self._factor = self._factorised()

    def _factorised(self) -> Any:
        matrix = self._stiffness
        for one, push, hold in zip(self.interfaces, self._pushing, self._holding, strict=True):
            matrix = matrix + push @ (diags_array(hold) @ one.constraints)
        inside = csr_array(matrix)[self.free][:, self.free].tocsc()
        try:
            with one_blas_thread():
                factor = splu(
                    inside, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.1, options={"SymmetricMode": True}
                )
        except RuntimeError as error:
            raise SensitivityError(f"{_NONE}: its tangent is singular ({error})") from error
        inverse = LinearOperator(inside.shape, matvec=factor.solve, rmatvec=lambda b: factor.solve(b, "T"), dtype=float)
        if not onenormest(inverse, t=1) * abs(inside).sum(axis=0).max() < _SINGULAR:
            raise SensitivityError(f"{_NONE}: a body is free to move")
        return factor

    def response(self, change: Perturbation) -> Response:
        """Derivative of the equilibrium by a parameter.

        Raises:
            SensitivityError: The multiplier iteration does not converge (nearly singular tangent).
        """
        explicit, fixed = self._explicit(change)
        du = np.zeros(self._body.degrees)
        if change.prescribed is not None:
            du[~self.free] = change.prescribed[~self.free]
        pull = sum((one.spreading @ e for one, e in zip(self.interfaces, explicit, strict=True)), self._stiffer(change))
        multipliers = self._solved(du, pull, fixed)
        nodal, pressing = [], []
        for one, push, force, known in zip(self.interfaces, self._pushing, multipliers, explicit, strict=True):
            nodal.append(one.by_force @ du + push @ force + one.spreading @ known)
            pressing.append(force[: len(one.sites)])
        held = (
            self._stiffness @ du
            - pull
            - sum((push @ force for push, force in zip(self._pushing, multipliers, strict=True)), np.zeros_like(du))
        )
        shape = (len(self.interfaces), -1, 3)
        return Response(
            du.reshape(-1, 3),
            np.where(self.free, 0.0, held).reshape(-1, 3),
            np.array(nodal).reshape(shape) if nodal else np.zeros((0, *self._u.shape)),
            tuple(one.sites for one in self.interfaces),
            tuple(pressing),
        )

    @property
    def contact(self) -> Array:
        """Contact forces of each pair on all nodes at the equilibrium [N], shape (P, N, 3)."""
        forces = [(o.spreading @ (o.rub - o.press[:, None] * o.normal).ravel()) for o in self.interfaces]
        return np.array(forces).reshape(len(forces), *self._u.shape)

    @property
    def pushed(self) -> Array:
        """Normal force on every node, as ``NodalContact.force`` [N], shape (P, N)."""
        zero = np.zeros_like(self._u)
        return self._pushed(zero, [np.zeros(len(one.sites)) for one in self.interfaces])

    def pushes(self, response: Response) -> Array:
        """Derivative of ``pushed``, by central differences, shape (P, N)."""
        step = _FAR / max(float(np.abs(response.displacement).max(initial=0.0)), _FAR)
        ends = [
            self._pushed(by * response.displacement, [by * pressing for pressing in response.pressing])
            for by in (step, -step)
        ]
        return (ends[0] - ends[1]) / (2.0 * step)

    def _pushed(self, move: Array, more: Sequence[Array]) -> Array:
        """Normal force on every node after a move (N, 3), with increments of the multipliers."""
        out = np.zeros((len(self.interfaces), len(self._u)))
        x = self._body.mesh.nodes + self._u + move
        for k, (interface, one) in enumerate(zip(self._interfaces, self.interfaces, strict=True)):
            pressing = np.zeros(len(interface.edge))
            pressing[one.sites] = one.press + more[k]
            points = interface.points(x, *self._times)
            force = pressing[points.sites] * (1.0 if one.obstacle is not None else points.area)
            out[k] = _pushing(points, interface.slave.nodes, force)
        return out

    def _explicit(self, change: Perturbation) -> tuple[list[Array], list[Array]]:
        """Partial derivatives by the parameter at constant u and multipliers: tractions (3k,) and constraints of each
        interface."""
        tractions, fixed = [], []
        for k, one in enumerate(self.interfaces):
            force, gap = np.zeros(3 * len(one.sites)), np.zeros(one.constraints.shape[0])
            if k in change.obstacles:
                if one.obstacle is None:
                    raise InputError(f"obstacles: pair {k} has no obstacle")
                force, gap = one.moved(change.obstacles[k])
            if k in change.friction:
                force = force + change.friction[k] * one.rubbed()
            tractions.append(force)
            fixed.append(gap)
        return tractions, fixed

    def _stiffer(self, change: Perturbation) -> Array:
        """Negative change of the internal forces by changed moduli [N], shape (3N,)."""
        if change.stiffness is None:
            return np.zeros(self._body.degrees)
        forces = []
        for factor in (0.0, 1.0):
            other = copy(self._body)
            other.constants = self._body.constants.copy()
            other.constants[:, :3] *= (1.0 + factor * change.stiffness)[:, None]
            forces.append(Elastic(other).forces(self._u.reshape(-1)).forces)
        return forces[0] - forces[1]

    def _solved(self, du: Array, pull: Array, fixed: list[Array]) -> list[Array]:
        """Solve (7): fill in du (3N,) at free degrees of freedom; returns the derivatives of each interface's
        multipliers."""
        free, known = self.free, du.copy()
        held = [np.zeros(len(gap)) for gap in fixed]
        size, before = 0.0, np.inf
        for _ in range(_ROUNDS):
            right = pull - self._stiffness @ known
            for one, push, hold, gap, now in zip(
                self.interfaces, self._pushing, self._holding, fixed, held, strict=True
            ):
                right = right + push @ (now - hold * (gap + one.constraints @ known))
            du[free] = self._factor.solve(right[free])
            left = [gap + one.constraints @ du for one, gap in zip(self.interfaces, fixed, strict=True)]
            held = [now - hold * gap for now, hold, gap in zip(held, self._holding, left, strict=True)]
            open_ = norm(np.concatenate([np.zeros(1), *left]))
            size = max(size, open_, norm(du) / np.sqrt(len(du)))
            if not np.isfinite(open_) or open_ > 1e3 * before:
                break
            if open_ <= _EXACT * size:
                return held
            before = min(before, open_)
        raise SensitivityError(f"{_NONE}: what touches does not follow the parameter")


def _pushing(points: ContactPoints, slave: Ints32, force: Array) -> Array:
    """Normal force on every node [N], shape (N,), from forces at points (m,) [N], distributed as in ``touch_of``."""
    share = points.weights[:, slave].maximum(0.0)
    weight = share.T.multiply(points.area).tocsr()
    area = np.asarray(weight.sum(axis=1)).ravel()
    mean = csr_array(weight.multiply(1.0 / np.where(area > 0.0, area, 1.0)[:, None]))
    push = share.T @ force
    out = np.asarray((mean @ (-points.weights).maximum(0.0)).T @ push, dtype=np.float64)
    out[slave] += push
    return out


def _holding(one: InterfaceSlopes, stiffness: Array) -> Array:
    """Penalties E of an interface's constraints, from the nodes' stiffness (N,) [N/m]."""
    stiff = _STIFF * (abs(one.weights) @ stiffness) / one.scale
    return np.concatenate([stiff, np.repeat(stiff[one.sticks], 2)])
