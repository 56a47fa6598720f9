"""One load step of bodies in contact: Newton's method on bodies and contact together.

The system is K plus a moderate penalty at the contact points, symmetric and well conditioned, so that conjugate
gradients keep working; the multipliers are brought up to date after every linear solve, so that what the penalty
leaves of overlap and slip is gone when forces balance (Simo & Laursen 1992; reference: B §3.4, R108, R117).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.blockmatrix import BlockMatrix
from warpjld.fem.body import Body, Tangent
from warpjld.fem.conjugate import Iteration, Status
from warpjld.fem.contact.law import Memory, Response, remember, respond
from warpjld.fem.contact.points import ContactPoints, Interface
from warpjld.fem.contact.stiffness import with_contact
from warpjld.fem.dots import dot, norm
from warpjld.fem.linear import LinearSolver
from warpjld.fem.loads import Loads, external_forces, subtract_pressure_stiffness
from warpjld.fem.multigrid import IndefiniteError
from warpjld.fem.prescribed import Prescribed, free_motions

__all__ = ["Equilibrium", "Reached", "Step"]

_ITERATIONS = 40
_PENALTY = 300.0
"""Contact stiffness over the stiffness of a node: more makes the linear solves slow, less makes them many."""
_SETTLED = 2e-3
"""Share of the contact forces by which the multipliers may still change."""
_ROUNDING = 1e-13
"""Part of stiffness times displacement that is rounding, where bodies move without a force."""
_PLACES = 0.03
"""The same of positions, over that of displacements: gaps are differences of positions."""
_HELD = (3e-2, 0.4, 1e-4)
"""Stiffness given to bodies that only contact holds, over their own: it slows them down, and leaves no force. At first,
so that contact is found before they fly off; by which factor it then falls with each iteration; and the least.
"""
_TURNING = 1
"""Iterations after which normals stay; weights follow until they no longer change the gaps. That both are right is
looked at once forces balance. (Newton's method without their derivatives converges slowly, with them not symmetric.)"""
_CARELESS = 8
"""Iterations with full steps and multipliers brought up to date at once; what has not settled by then takes turns."""
_LINE_SEARCH = 8
_STIFFENED = (0.0, 0.02, 0.1, 0.5)
_INNER = 1e-4
_PATIENCE = 25
"""Iterations after which a preconditioner made for an earlier matrix has served its time."""


@dataclass(frozen=True, eq=False)
class Step:
    """What a load step goes from and to.

    Attributes:
        before: Time it starts from.
        time: Time it goes to.
        prescribed: Displacements at ``time``.
        loads: Loads, and the share of them that acts at ``time``.
        share: That share.
        allowed: Share of the overlap at the start that is still allowed at ``time``.
    """

    before: float
    time: float
    prescribed: Prescribed
    loads: Loads
    share: float
    allowed: float


@dataclass(frozen=True, eq=False)
class Reached:
    """Equilibrium at the end of a load step."""

    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    points: list[ContactPoints]
    responses: list[Response]
    slips: list[NDArray[np.float64]]
    memory: list[Memory]
    residual: float


@dataclass(frozen=True, eq=False)
class _Contact:
    """Every interface's points, slips [m] and responses, and their nodal forces together [N], shape (3N,)."""

    points: list[ContactPoints]
    slips: list[NDArray[np.float64]]
    responses: list[Response]
    forces: NDArray[np.float64]


class Equilibrium:
    """The bodies and interfaces of a contact problem, and the matrices kept between steps.

    Args:
        body: All bodies, merged.
        interfaces: What may touch.
        tolerance: Relative residual.
        penetration: Overlap left, as a share of an edge.
        precision: Of the linear solver.
    """

    def __init__(
        self,
        body: Body,
        interfaces: list[Interface],
        *,
        tolerance: float = 1e-5,
        penetration: float = 1e-3,
        penalty: float = _PENALTY,
        precision: str = "float64",
    ) -> None:
        self.body = body
        self.interfaces = interfaces
        self.solves = 0
        self.iterations = 0
        self.trouble = ""
        self._tolerance = tolerance
        self._penetration = penetration
        self._penalty = penalty
        bulk, shear = body.constants[:, 2], 2.0 * body.constants[:, :2].sum(axis=1)
        poisson = float(((3 * bulk - 2 * shear) / (6 * bulk + 2 * shear)).max())
        self._options: dict[str, Any] = {"precision": precision, "threads": body.threads, "poisson": poisson}
        self._hierarchy: list[Any] | None = None
        self._tangent: Tangent | None = None
        self._rest = None if body.large_strain else body.at()
        self._loose: tuple[bytes, list[NDArray[np.int64]]] | None = None
        tangent = self._rest or body.at()
        assert tangent.stiffness is not None
        blocks = tangent.stiffness.diagonal()
        self._stiff = np.einsum("nii->n", blocks) / 3.0
        self._stiff_of = [self._meeting(interface) for interface in interfaces]

    def _meeting(self, interface: Interface) -> NDArray[np.float64]:
        """Stiffness of sites against what they meet [N/m], shape (s,)."""
        own = interface.share @ self._stiff[interface.slave.nodes]
        if len(interface.opposite) == 0:
            return own
        return np.asarray(np.minimum(own, float(np.median(self._stiff[interface.opposite]))))

    def find(
        self,
        u: NDArray[np.float64],
        memory: list[Memory],
        step: Step,
        first: NDArray[np.float64] | None = None,
    ) -> tuple[Status, Reached | None]:
        """Equilibrium from displacement u (3N,) at ``step.before``; ``first`` is where to begin to look."""
        body, start = self.body, u
        known = step.prescribed.degrees
        free = step.prescribed.free(body.degrees)
        loose = self._unheld(step.prescribed)
        memory = self._begun(memory, start, step)
        pressures: NDArray[np.float64] | None = None
        jump = np.zeros_like(u)
        guessed = self._guessed(first, step.prescribed)
        if guessed is None:
            u = start.copy()
            jump[known] = step.prescribed.values - u[known]
        else:
            u = guessed
            # a guess squeezes elements here and there: their false pressures would make K indefinite, those of the
            # equilibrium before do not
            pressures = body.at(start, stiffness=False).pressures if body.large_strain else None
        solver: LinearSolver | None = None
        normals = self._normals(u)
        held = (self._points(u, step, normals), u)
        settled, since, falls = False, 0, 0
        contact = self._answered(held[0], u, start, memory, keep=True, allowed=step.allowed)
        for iteration in range(_ITERATIONS):
            careful = iteration - since >= _CARELESS
            tangent = self._at(u, pressures)
            external = step.share * external_forces(body, step.loads, u if body.large_strain else None)
            residual = np.where(free, external + contact.forces - tangent.forces, 0.0)
            balance = tangent.forces - external - contact.forces
            moved = not jump.any()
            pushed = norm(np.where(free, contact.forces, 0.0))
            scale = max(norm(external), pushed, norm(np.where(free, 0.0, balance)), 1e-300)
            now = norm(residual) / scale
            noise = _ROUNDING * (norm(np.repeat(self._stiff, 3) * u) + _PLACES * norm(self._stiff) * body.mesh.size)
            negligible = max(self._tolerance * scale, noise)
            settled_down = pushed <= noise or self._settled(contact, memory, negligible)
            if moved and now <= max(self._tolerance, noise / scale) and settled_down:
                normals = self._normals(u)
                fresh = self._points(u, step, normals)
                if step.allowed > 0.0 or self._mismatch(fresh, contact.points, contact.responses) <= self._penetration:
                    return Status.CONVERGED, self._reached(u, np.where(free, 0.0, balance), contact, memory, now)
                held, settled, since = (fresh, u), False, iteration
                contact = self._answered(fresh, u, start, memory, keep=True, allowed=step.allowed)
                continue
            if not np.isfinite(now):
                return Status.NOT_FINITE, None
            stiffness = tangent.stiffness
            assert stiffness is not None
            if body.large_strain:
                subtract_pressure_stiffness(stiffness, body, step.loads, u, step.share)
            matrix = with_contact(
                stiffness, contact.points, [r.blocks for r in contact.responses], threads=body.threads
            )
            matrix = self._steadied(matrix, stiffness, loose, iteration - since)
            try:
                solver, done = self._solve(solver, matrix, free, residual - matrix.product(jump, threads=body.threads))
            except IndefiniteError:
                return Status.INDEFINITE, None
            self.solves += 1
            self.iterations += done.iterations
            if done.status in (Status.INDEFINITE, Status.NOT_FINITE):
                return done.status, None
            move = done.x + jump
            if not jump.any():
                move *= self._leash(loose, move)
            watched = free if moved and careful else free & np.repeat(self._falling(loose, contact), 3)
            length = self._search(u, move, contact, memory, step, residual, watched, patient=careful)
            if length == 0.0:
                return Status.INVERTED, None
            move *= length
            if body.large_strain:
                pressures = body.at(u, stiffness=False, increment=move).pressures
            u = u + move
            jump *= 1.0 - length
            if length == 1.0:
                u[known] = step.prescribed.values
                jump[:] = 0.0
            foreseen = self._foreseen(contact, memory, move, step.allowed, patient=careful)
            if not careful or _alike(contact.responses, foreseen):
                memory = self._remembered(memory, contact, foreseen, move, patient=careful)
            points = [_shifted(p, (u - held[1]).reshape(-1, 3)) for p in held[0]]
            if not settled:
                normals = self._normals(u) if iteration < _TURNING else normals
                fresh = self._points(u, step, normals)
                settled = iteration > _TURNING and self._mismatch(fresh, points, foreseen) <= 0.5 * self._penetration
                held, points = (held, points) if settled else ((fresh, u), fresh)
            careful = iteration + 1 - since >= _CARELESS
            contact = self._answered(points, u, start, memory, keep=not careful, allowed=step.allowed)
            falls = falls + 1 if self._falling(loose, contact).any() else 0
            if falls > _CARELESS:
                break
        return self._unresolved(loose, contact), None

    def _guessed(self, first: NDArray[np.float64] | None, prescribed: Prescribed) -> NDArray[np.float64] | None:
        """A first guess that satisfies what is prescribed, unless it turns an element inside out."""
        if first is None:
            return None
        u = np.array(first, dtype=np.float64).reshape(-1)
        u[prescribed.degrees] = prescribed.values
        upright = (self.body.at(u, stiffness=False).lowest > 0).all()
        return u if upright or self._rest is not None else None

    def _solve(
        self, solver: LinearSolver | None, matrix: BlockMatrix, free: NDArray[np.bool_], right: NDArray[np.float64]
    ) -> tuple[LinearSolver, Iteration]:
        """With the preconditioner of the step's first matrix while it serves.

        Flesh that is about to fold has a K that is not positive definite on the way to its fold. A share of each node's
        own stiffness is then added until it is: the step is shorter, where it leads is not changed.
        """
        sofar = None
        if solver is not None:
            before = solver.of(matrix)
            done = before.solve(right, tolerance=_INNER, iterations=_PATIENCE)
            if done.status is Status.CONVERGED:
                return solver, done
            if done.status is Status.MAX_ITERATIONS and done.residual < 1.0:
                sofar = done
                left = right - before.masked_product(done.x)
        for share in _STIFFENED:
            if share:
                matrix = self._stiffened(matrix, share)
            try:
                solver = LinearSolver(matrix, free, self.body.mesh, hierarchy=self._hierarchy, **self._options)
                if sofar is not None and not share:  # go on from where the old preconditioner got to
                    done = solver.solve(left, tolerance=_INNER / sofar.residual)
                    done = replace(done, x=done.x + sofar.x, iterations=done.iterations + sofar.iterations)
                else:
                    done = solver.solve(right, tolerance=_INNER)
            except IndefiniteError:
                if share == _STIFFENED[-1]:
                    raise
                continue
            if done.status is not Status.INDEFINITE:
                break
        assert solver is not None
        self._hierarchy = solver.hierarchy
        return solver, done

    def _stiffened(self, matrix: BlockMatrix, share: float) -> BlockMatrix:
        """A matrix with a share of the nodes' stiffness at rest added."""
        values = matrix.values.copy()
        row = np.repeat(np.arange(matrix.size, dtype=np.int32), np.diff(matrix.rows))
        values[np.flatnonzero(row == matrix.columns)] += (share * self._stiff)[:, None, None] * np.eye(3)
        return BlockMatrix(matrix.rows, matrix.columns, values)

    def _search(
        self,
        u: NDArray[np.float64],
        move: NDArray[np.float64],
        contact: _Contact,
        memory: list[Memory],
        step: Step,
        residual: NDArray[np.float64],
        watched: NDArray[np.bool_],
        *,
        patient: bool,
    ) -> float:
        """How far to go, zero for nowhere: no element inside out; and, where forces on the watched degrees of freedom
        (3N,) pull back there harder than half of what drives here, to where they balance along the way. A contact that
        opens and closes in turn settles so, and what falls freely stops where it first touches.
        """
        body = self.body
        length = 1.0
        if self._rest is not None and not watched.any():
            return length
        for _ in range(_LINE_SEARCH):
            there = u + length * move
            trial = self._at(there, None) if self._rest is not None else body.at(there, stiffness=False)
            if self._rest is not None or (trial.lowest > 0).all():
                break
            length *= 0.5
        else:
            return 0.0
        if not watched.any() or length < 1.0:
            return length
        external = step.share * external_forces(body, step.loads, there if body.large_strain else None)
        along = np.where(watched, move, 0.0)
        here = dot(residual - contact.forces, along)
        ahead = dot(external - trial.forces, along)

        def pull(part: float) -> float:
            """What drives on after part of the way: the bodies' forces change linearly, contact as it must."""
            pushed = np.zeros_like(body.mesh.nodes)
            foreseen = self._foreseen(contact, memory, part * move, step.allowed, patient=patient)
            for p, r in zip(contact.points, foreseen, strict=True):
                pushed += p.forces(r.traction(p))
            return here + part * (ahead - here) + dot(pushed.reshape(-1), along)

        start, end = pull(0.0), pull(1.0)
        if not (start > 0.0 and end < -0.5 * start):
            return 1.0
        from scipy.optimize import brentq

        return max(float(brentq(pull, 0.0, 1.0, xtol=1e-14, rtol=1e-6, maxiter=60, disp=False)), 1e-12)

    def _at(self, u: NDArray[np.float64], pressures: NDArray[np.float64] | None) -> Tangent:
        if self._rest is None:
            self._tangent = self.body.at(u, pressures=pressures, reuse=self._tangent)
            return self._tangent
        assert self._rest.stiffness is not None
        return replace(
            self._rest, forces=self._rest.forces + self._rest.stiffness.product(u, threads=self.body.threads)
        )

    def _normals(self, u: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        x = self.body.mesh.nodes + u.reshape(-1, 3)
        return [interface.slave.normals(x) for interface in self.interfaces]

    def _points(self, u: NDArray[np.float64], step: Step, normals: list[NDArray[np.float64]]) -> list[ContactPoints]:
        """Every interface's points at displacement u (3N,)."""
        x = self.body.mesh.nodes + u.reshape(-1, 3)
        return [i.points(x, step.before, step.time, n) for i, n in zip(self.interfaces, normals, strict=True)]

    def _answered(
        self,
        points: list[ContactPoints],
        u: NDArray[np.float64],
        start: NDArray[np.float64],
        memory: list[Memory],
        *,
        keep: bool,
        allowed: float,
    ) -> _Contact:
        """What points answer at displacement u (3N,)."""
        since = (u - start).reshape(-1, 3)
        slips = [p.relative(since) - p.carried for p in points]
        responses = [
            respond(i.pair, p, m, slip, self._stiff_penalty(k, p), allowed, keep=keep, patient=not keep)
            for k, (i, p, m, slip) in enumerate(zip(self.interfaces, points, memory, slips, strict=True))
        ]
        total = np.zeros_like(self.body.mesh.nodes)
        for p, r in zip(points, responses, strict=True):
            total += p.forces(r.traction(p))
        return _Contact(points, slips, responses, total.reshape(-1))

    def _foreseen(
        self, contact: _Contact, memory: list[Memory], move: NDArray[np.float64], allowed: float, *, patient: bool
    ) -> list[Response]:
        """What points answer after a move, by the linear model: the multipliers to go on with."""
        out = []
        for k, (p, m, slip) in enumerate(zip(contact.points, memory, contact.slips, strict=True)):
            there = _shifted(p, move.reshape(-1, 3))
            slip = slip + p.relative(move.reshape(-1, 3))
            penalty = self._stiff_penalty(k, p)
            out.append(respond(self.interfaces[k].pair, there, m, slip, penalty, allowed, patient=patient))
        return out

    def _remembered(
        self,
        memory: list[Memory],
        contact: _Contact,
        foreseen: list[Response],
        move: NDArray[np.float64],
        *,
        patient: bool,
    ) -> list[Memory]:
        out = []
        for k, (m, p, r) in enumerate(zip(memory, contact.points, foreseen, strict=True)):
            slip = contact.slips[k] + p.relative(move.reshape(-1, 3))
            pair, known, penalty = self.interfaces[k].pair, contact.responses[k].active, self._stiff_penalty(k, p)
            out.append(remember(pair, m, p, r, slip, penalty, known, patient=patient))
        return out

    def _reached(
        self,
        u: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: _Contact,
        memory: list[Memory],
        residual: float,
    ) -> Reached:
        kept = self._remembered(memory, contact, contact.responses, np.zeros_like(u), patient=True)
        kept = [replace(m, anchor=np.zeros_like(m.anchor)) for m in kept]
        return Reached(u, reactions, contact.points, contact.responses, contact.slips, kept, residual)

    def _stiff_penalty(self, k: int, points: ContactPoints) -> NDArray[np.float64]:
        """ε of points [Pa/m]: a multiple of the stiffness of their nodes, over the area they would have whole."""
        edge = self.interfaces[k].edge[points.sites]
        return np.asarray(self._penalty * self._stiff_of[k][points.sites] / edge**2)

    def _begun(self, memory: list[Memory], start: NDArray[np.float64], step: Step) -> list[Memory]:
        """Memory that knows what is apart as the step begins, where friction asks for it."""
        x = self.body.mesh.nodes + start.reshape(-1, 3)
        out = []
        for interface, m in zip(self.interfaces, memory, strict=True):
            if interface.pair.friction > 0.0:
                points = interface.points(x, step.before, step.before)
                apart = np.ones(len(m.apart), dtype=bool)
                apart[points.sites] = points.gap > self._penetration * interface.edge[points.sites]
                m = replace(m, apart=apart)
            out.append(m)
        return out

    def _settled(self, contact: _Contact, memory: list[Memory], negligible: float) -> bool:
        """Whether multipliers stay: overlap is gone, and forces change by little, or by what is ``negligible``."""
        for k, (p, r, m) in enumerate(zip(contact.points, contact.responses, memory, strict=True)):
            if not r.active.any():
                continue
            if (r.error / self.interfaces[k].edge[p.sites]).max() > self._penetration:
                return False
            change = np.abs(r.pressure - m.pressure[p.sites]) + np.linalg.norm(r.friction - m.friction[p.sites], axis=1)
            size = np.abs(r.pressure) + np.linalg.norm(r.friction, axis=1)
            if p.area @ change > max(_SETTLED * (p.area @ size), negligible):
                return False
        return True

    def _mismatch(self, fresh: list[ContactPoints], points: list[ContactPoints], responses: list[Response]) -> float:
        """How far gaps as they are differ from those believed, where surfaces press or overlap, over an edge."""
        worst = 0.0
        for k, (p, r, q) in enumerate(zip(points, responses, fresh, strict=True)):
            edge = self.interfaces[k].edge
            active = np.zeros(len(edge), dtype=bool)
            active[p.sites] = r.active
            believed = np.full(len(edge), np.inf)
            believed[p.sites] = p.gap
            off = np.abs(q.gap - believed[q.sites])
            off = np.where(active[q.sites], off, np.minimum(off, np.maximum(-q.gap, 0.0)))
            worst = max(worst, float((off / edge[q.sites]).max(initial=0.0)))
        return worst

    def _unheld(self, prescribed: Prescribed) -> list[NDArray[np.int64]]:
        """Nodes of each body that the prescribed displacements do not hold."""
        key = prescribed.degrees.tobytes()
        if self._loose is None or self._loose[0] != key:
            self._loose = (key, [nodes for nodes, _ in free_motions(self.body, prescribed)])
        return self._loose[1]

    def _falling(self, loose: list[NDArray[np.int64]], contact: _Contact) -> NDArray[np.bool_]:
        """Nodes of loose bodies that nothing touches, shape (N,)."""
        out = np.zeros(len(self.body.mesh.nodes), dtype=bool)
        if loose:
            touched = np.zeros(len(out), dtype=bool)
            for p, r in zip(contact.points, contact.responses, strict=True):
                touched[p.weights[np.flatnonzero(r.active)].indices] = True
            for nodes in loose:
                out[nodes] = not touched[nodes].any()
        return out

    def _unresolved(self, loose: list[NDArray[np.int64]], contact: _Contact) -> Status:
        """Why no equilibrium was found: a loose body that nothing touches, or that slides wherever it is touched."""
        for nodes in loose:
            mine = np.zeros(len(self.body.mesh.nodes), dtype=bool)
            mine[nodes] = True
            element = int(np.flatnonzero(mine[self.body.mesh.elements[:, 0]])[0])
            what = f"'{self.body.mesh.region_names[self.body.mesh.regions[element]]}'"
            touching = []
            for interface, p, r in zip(self.interfaces, contact.points, contact.responses, strict=True):
                rows = np.flatnonzero(r.active)
                rows = rows[(p.weights[rows] @ mine.astype(float) != 0.0)] if len(rows) else rows
                if len(rows):
                    touching.append((interface.pair.title, bool(r.sticking[rows].any())))
            if not touching:
                self.trouble = f"nothing holds {what}"
                return Status.UNHELD
            if not any(sticks for _, sticks in touching):
                self.trouble = f"{what} slides at {touching[0][0]}: friction is not enough to hold it"
                return Status.SLIDING
        return Status.MAX_ITERATIONS

    def _leash(self, loose: list[NDArray[np.int64]], move: NDArray[np.float64]) -> float:
        """Share of a move by which loose bodies go no farther than they look ahead."""
        far = max((float(np.abs(move.reshape(-1, 3)[nodes]).max()) for nodes in loose), default=0.0)
        reach = min(interface.reach for interface in self.interfaces)
        return min(1.0, reach / far) if far > 0.0 else 1.0

    def _steadied(
        self, matrix: BlockMatrix, own: BlockMatrix, loose: list[NDArray[np.int64]], turn: int
    ) -> BlockMatrix:
        if not loose:
            return matrix
        nodes = np.sort(np.concatenate(loose))
        if matrix is own:
            matrix = BlockMatrix(own.rows, own.columns, own.values.copy())
        row = np.repeat(np.arange(matrix.size, dtype=np.int32), np.diff(matrix.rows))
        place = np.flatnonzero(row == matrix.columns)[nodes]
        first, falls, least = _HELD
        held = max(least, first * falls**turn)
        matrix.values[place] += (held * self._stiff[nodes])[:, None, None] * np.eye(3)
        return matrix


def _shifted(points: ContactPoints, move: NDArray[np.float64]) -> ContactPoints:
    """Points after a move (N, 3), by the linear model: their normals and weights stay."""
    if not move.any():
        return points
    return replace(points, gap=points.gap - np.einsum("mi,mi->m", points.normal, points.relative(move)))


def _alike(responses: list[Response], others: list[Response]) -> bool:
    """Whether the same points touch, and stick, in both."""
    return all(
        np.array_equal(r.active, s.active) and np.array_equal(r.sticking, s.sticking)
        for r, s in zip(responses, others, strict=True)
    )
