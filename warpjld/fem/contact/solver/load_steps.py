"""Load stepping: an equilibrium at each time from a predictor, with adaptive cutting and halving of steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_area import contact_modulus
from warpjld.fem.contact.interface.contact_interface import interfaces_of
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.law.contact_state import without_bonds
from warpjld.fem.contact.law.return_mapping import overstrained
from warpjld.fem.contact.results.contact_solution import ContactInstant, ContactSolution
from warpjld.fem.contact.solver.contact_newton import ContactNewton
from warpjld.fem.contact.solver.contact_system import LoadStep
from warpjld.fem.contact.solver.first_states import first_state
from warpjld.fem.contact.solver.first_touch import first_touch, slid_unheld, touched_at
from warpjld.fem.contact.solver.friction_continuation import continue_in_friction
from warpjld.fem.contact.solver.instants import instant_of, last_step_of
from warpjld.fem.contact.solver.newton_state import Equilibrium
from warpjld.fem.contact.solver.passing import Passing, guess_jumps
from warpjld.fem.contact.solver.predicted_motion import PredictedMotion
from warpjld.fem.contact.solver.solve_budget import SolveBudget
from warpjld.fem.contact.solver.statics import could_balance
from warpjld.fem.contact.solver.unconstrained import blocked
from warpjld.fem.load.inertia import Dynamics, Inertia, lumped_masses
from warpjld.fem.load.loads import Loads, external_forces
from warpjld.fem.load.prescribed import Prescribed, free_motions
from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["Guess", "LoadSteps"]

_HALVINGS = 7
"""Most successive halvings of a failing load step."""
_HALVINGS_UNHELD = 3
"""The same if the failure is a body that slides away or is not held, which seldom depends on the length of the step."""
_UNHELD = (SolveStatus.SLIDING, SolveStatus.UNHELD)
"""Statuses of a body that slides away or is not held."""
_BRIEF = 25
"""Most Newton iterations of a search if no step may be halved: the caller will try a shorter step itself. For the same
reason there is then one search."""
_BREAKS = 100
"""Most rounds of breaking bonds in a load step."""
_CUTS = 400
"""Most cuts of steps in a run, made so that contact search can follow."""
_TOUCHING = 0.01
"""Smallest fraction of a step at which it is cut for a first contact."""
_TOUCHES, _TOUCHES_FREE = 8, 2
"""Most halvings of a step in which frictional contact begins after sliding at an unknown time; and the same for a free
body, which falls however short the step is."""
_WHOLE = 0.95
"""Fraction of a step above which it is not cut."""
_FAR = 2.2
"""Search distance over the initial overlap that has to be removed; contact fades beyond half of it."""
_PART = 0.85
"""Fraction of the last step's correction that a predictor adds: contact stiffens, so corrections decrease."""
_STAYS = 1e-9
"""Change of a prescribed displacement, over the bodies' size, that is none."""

Guess = Callable[[float, float, Array], Array]
"""Predictor: time before, time, displacement before (N, 3) → guess of the displacement at the time (N, 3)."""


class LoadSteps:
    """One run of ``press`` by the augmented Lagrangian method; arguments as there.

    Attributes:
        u: Displacement of the last equilibrium [m], shape (3N,).
        states: Contact state of each interface there.
        steps: Number of linear solves of each load step taken.
        pressed: Highest pressure there [Pa].
        velocity: Velocity there [m/s], shape (3N,); None without inertia.
    """

    def __init__(
        self,
        body: Body,
        prescribed: Prescribed | Callable[[float], Prescribed],
        pairs: list[Pair],
        loads: Loads | Callable[[float], Loads] | None,
        times: list[float],
        after: ContactSolution | None,
        tolerance: float,
        penetration: float,
        guess: Guess | None = None,
        halvings: int | None = None,
        solves: int | None = None,
        dynamics: Dynamics | None = None,
    ) -> None:
        self.body = body
        self.times = times
        self.prescribed = prescribed
        self.loads = loads or Loads()
        self.guess = guess
        self.halvings, self.budget = halvings, SolveBudget(solves)
        self.interfaces = interfaces_of(body.mesh, pairs, body.threads)
        self._reaches = [interface.reach for interface in self.interfaces]
        self.moduli = [contact_modulus(body, interface) for interface in self.interfaces]
        self.motion = PredictedMotion(body)
        self.passing = Passing(body, self.interfaces)
        self.newton = ContactNewton(body, self.interfaces, self.moduli, tolerance=tolerance, penetration=penetration)
        if halvings == 0:
            self.newton.most, self.newton.once = _BRIEF, True
        if after is None:
            self.start = 0.0
            self.u = np.zeros(body.degrees)
            self._extend_search()
            self.states = [first_state(interface, body.mesh.nodes) for interface in self.interfaces]
        else:
            if after.last.displacement.size != body.degrees:
                raise InputError(f"after: is of a body with {after.last.displacement.size} degrees of freedom")
            self.start = after.last.time
            self.u = after.last.displacement.reshape(-1).copy()
            self.states = list(after.states)
        self.steps: list[int] = []
        self.pressed = 0.0
        self._dynamics = None if dynamics is None else dynamics.checked(body)
        self._masses = None if dynamics is None else lumped_masses(body)
        self.velocity: Array | None = None if dynamics is None else np.asarray(dynamics.velocity, float).reshape(-1)
        self.correction_rate = None if after is None else after.correction_rate
        self.last_step = None if after is None else after.last_step

    def _extend_search(self) -> None:
        """Extend the search distance to the depth of initial overlaps, until these are removed."""
        for k, interface in enumerate(self.interfaces):
            interface.reach = max(interface.reach, _FAR * self.passing.depth(self.u, k))

    def _step(self, before: float, time: float) -> LoadStep:
        """Load step between two times."""
        share = time / self.times[-1]
        known = self.prescribed
        now = known(time) if callable(known) else known.scaled(share)
        loads = self.loads(time) if callable(self.loads) else self.loads.scaled(share)
        inertia = self._inertia(before, time)
        held = inertia is not None or loads.drag is not None or not self.motion.leaves_free(now)
        return LoadStep(before, time, now, loads, self.allowed(time), inertia, held)

    def _inertia(self, before: float, time: float) -> Inertia | None:
        """Inertia in a step between two times."""
        if self._dynamics is None or self._masses is None or self.velocity is None:
            return None
        return Inertia(self._masses, self.u, self.velocity, self._dynamics.second * (time - before))

    def _leaves_free(self, step: LoadStep) -> bool:
        """Whether nothing but contact holds a body in a step."""
        return not step.held

    def allowed(self, time: float) -> float:
        """Share of the overlap at the start that is still allowed at a time."""
        overlap = any(state.allowance.any() for state in self.states)
        return max(0.0, 1.0 - (time - self.start) / (self.times[0] - self.start)) if overlap else 0.0

    def run(
        self, watch: Callable[[ContactInstant], str | None] | None, progress: Callable[[str], None] | None
    ) -> ContactSolution:
        """Solve all times, or as far as equilibria are found; ``watch`` and ``progress`` as in ``press``."""
        report = progress or (lambda text: None)
        now, halvings = self.start, 0
        reached: list[ContactInstant] = []
        todo = list(self.times)
        newton, budget, sides = self.newton, self.budget, (self.interfaces, self.moduli)
        cuts, touches, cut, unstable = 0, 0, 1.0, False
        unheld: tuple[float, Array, LoadStep, Equilibrium] | None = None
        while todo:
            target = todo[0]
            newton.solves, newton.iterations, newton.failure, newton.allowed = 0, 0, "", budget.left
            step = self._step(now, target)
            carried = self._carried(step)
            share, cut = self._share(step, carried, cut, may_cut=cuts < _CUTS)
            if share < _WHOLE:
                cuts += 1
                todo.insert(0, now + share * (target - now))
                continue
            status, found = self._find(step, carried)
            most = _TOUCHES_FREE if self._leaves_free(step) else _TOUCHES if step.inertia is None else 0
            if found is not None and touches < most and slid_unheld(self.interfaces, self.states, self.u, found):
                touches, unheld = touches + 1, (target, carried, step, found)
                todo.insert(0, 0.5 * (now + target))
                continue
            if found is None and unheld is not None:
                # a free body may have no equilibrium in the shorter step: use that of the longer one
                target, carried, step, found = unheld
                todo, touches, status = [time for time in todo if time >= target], most, SolveStatus.CONVERGED
            unheld = None
            through = "" if found is None else self._through(step, found)
            if through:
                status, found = SolveStatus.PASSED, None
            budget.count(newton.solves, newton.iterations, status)
            if found is None and status is SolveStatus.SLIDING:
                status = self._sliding(step)
            if overlap := self._blocked(step, found):
                message = f"no equilibrium at time {target:.4g}: {overlap}; no force can part them"
                return self._end(SolveStatus.BLOCKED, reached, message, step)
            if found is None:
                halvings += 1
                unstable = unstable or status is SolveStatus.INDEFINITE
                if halvings > self._most_halvings(status) or budget.left <= 0:
                    status, reason = budget.judged(*self._reason(status, through, unstable))
                    message = f"no equilibrium found after time {now:.4g} (tried {target:.4g}): {reason}"
                    return self._end(status, reached, message, step)
                report(f"time {target:.3g}: {status.value}; halving the step")
                todo.insert(0, 0.5 * (now + target))
                continue
            self._take(found, carried, step)
            now, cut, unstable = target, 1.0, False
            todo.pop(0)
            halvings = max(0, halvings - 1)
            if target not in self.times:
                continue
            one = instant_of(self.body.mesh.nodes, *sides, target, found, *budget.reached(), self.velocity)
            reached.append(one)
            report(f"time {target:.3g}: {one.solves} solves, {one.iterations} iterations, residual {one.residual:.1e}")
            touches = 0
            if watch and (stop := watch(reached[-1])):
                return self._end(SolveStatus.STOPPED, reached, stop, step)
        return self._end(SolveStatus.CONVERGED, reached, SolveStatus.CONVERGED.value, step)

    def _sliding(self, step: LoadStep) -> SolveStatus:
        """``SLIDING`` only if statics proves that friction cannot hold the body; else the solver failed to find how."""
        if not self._could_hold(step):
            return SolveStatus.SLIDING
        self.newton.failure = "friction could hold it, but how was not found"
        return SolveStatus.MAX_ITERATIONS

    def _reason(self, status: SolveStatus, through: str, unstable: bool) -> tuple[SolveStatus, str]:
        """Final status and reason of a failure; indefinite if a longer step was (``unstable``)."""
        if unstable and status is SolveStatus.MAX_ITERATIONS:
            return SolveStatus.INDEFINITE, through or SolveStatus.INDEFINITE.value
        return status, through or self.newton.failure or status.value

    def _share(self, step: LoadStep, carried: Array, cut: float, *, may_cut: bool) -> tuple[float, float]:
        """Fraction of a step to take, so that bodies do not pass through each other and friction acts from the first
        contact on; and the fraction due to the former, by which ``guess_jumps`` detects discontinuous predictors."""
        predicts = self.guess is not None or step.inertia is not None
        ahead = carried if predicts else self.motion.displacement(self.u, step.prescribed)
        share = self.passing.share(self.u, ahead, step.before, step.time)
        if share < _WHOLE and may_cut and not guess_jumps(share, cut):
            return share, share
        if step.inertia is not None:
            return 1.0, cut
        motion = (self.body.mesh.nodes, self.u, ahead)
        self.states = touched_at(self.interfaces, self.states, *motion, step)
        share = first_touch(self.interfaces, self.states, *motion, step)
        return share if _TOUCHING < share < _WHOLE and may_cut else 1.0, cut

    def _take(self, found: Equilibrium, carried: Array, step: LoadStep) -> None:
        """Accept an equilibrium as the start of the next step."""
        now, target = step.before, step.time
        self.steps.append(self.newton.solves)
        self.correction_rate = (found.displacement - carried).reshape(-1, 3) / (target - now)
        self.last_step = last_step_of(self.interfaces, now, self.u, found)
        if step.inertia is not None:
            self.velocity = step.inertia.velocity_at(found.displacement)
        self.u, self.states = found.displacement, found.states
        self.pressed = max((float(t.pressure.max(initial=0.0)) for t in found.tractions), default=0.0)
        if target in self.times:
            for interface, reach in zip(self.interfaces, self._reaches, strict=True):
                interface.reach = reach  # initial overlaps are removed at the first time

    def _through(self, step: LoadStep, found: Equilibrium) -> str:
        """Message about bodies that passed through, or lie undetected inside, each other; empty if there are none."""
        if step.allowed > 0.0:
            return ""
        pressed = [t.active for t in found.tractions]
        if words := self.passing.unseen(found.displacement, step.time, found.points, pressed):
            return words
        if self.passing.went_through(self.u, found.displacement, step.before, step.time):
            return "bodies would pass through each other"
        return ""

    def _most_halvings(self, status: SolveStatus) -> int:
        usual = _HALVINGS_UNHELD if status in _UNHELD else _HALVINGS
        return usual if self.halvings is None else min(usual, self.halvings)

    def _blocked(self, step: LoadStep, found: Equilibrium | None) -> str:
        """Message about an overlap of two prescribed sides; empty if there is none. ``found`` is None for a failed
        step."""
        free = step.prescribed.free(self.body.degrees)
        if found is None:
            u = self.u.copy()
            u[step.prescribed.degrees] = step.prescribed.values
            x = self.body.mesh.nodes + u.reshape(-1, 3)
            points = [interface.points(x, step.before, step.time) for interface in self.interfaces]
        else:
            points = found.points
        return blocked(self.interfaces, points, self.states, free, allowed=step.allowed)

    def _find(self, step: LoadStep, carried: Array) -> tuple[SolveStatus, Equilibrium | None]:
        """Equilibrium of a step, repeated after bonds were broken."""
        guesses = self._guesses(step, carried)
        status, found = self.newton.find(self.u, self.states, step, *guesses)
        # with halvings=0 the caller tries another step instead
        again = self.halvings != 0 and self._held_by_friction(step)
        if found is None and again and self._could_hold(step):
            status, found = continue_in_friction(self.newton, self.interfaces, self.u, self.states, step, status)
        for _ in range(_BREAKS):
            if found is None:
                return status, None
            known = zip(self.interfaces, found.states, found.points, found.tractions, strict=True)
            broken = [overstrained(i.pair, s, p, t) for i, s, p, t in known]
            if not any(mask.any() for mask in broken):
                return status, found
            states = [without_bonds(s, mask) for s, mask in zip(found.states, broken, strict=True)]
            if step.inertia is not None:  # bonds overstrained at the end of a step are open in the next one
                return status, replace(found, states=states)
            status, found = self.newton.find(self.u, states, step, found.displacement)
        return SolveStatus.MAX_ITERATIONS, None

    def _held_by_friction(self, step: LoadStep) -> bool:
        """Whether a free body may be held by friction."""
        return self._leaves_free(step) and any(i.pair.friction > 0.0 for i in self.interfaces)

    def _could_hold(self, step: LoadStep) -> bool:
        """Whether contact forces inside the friction cones could balance every free body (necessary condition)."""
        x = self.body.mesh.nodes + self.u.reshape(-1, 3)
        points = [interface.points(x, step.before, step.time) for interface in self.interfaces]
        force = external_forces(self.body, step.loads, self.u if self.body.large_strain else None).reshape(-1, 3)
        free = [nodes for nodes, _ in free_motions(self.body, step.prescribed)]
        known = (x, force, step.prescribed.degrees, self.interfaces, points)
        return all(could_balance(nodes, *known) for nodes in free)

    def _carried(self, step: LoadStep) -> Array:
        """Displacement at the start of a step, advanced by the caller's predictor or its velocity, shape (3N,)."""
        if self.guess is None:
            return self.u if step.inertia is None else step.inertia.coasted
        return np.asarray(self.guess(step.before, step.time, self.u.reshape(-1, 3)), dtype=np.float64).reshape(-1)

    def _guesses(self, step: LoadStep, carried: Array) -> list[Array]:
        """Initial guesses: the predictor with the last step's correction repeated, and the predictor alone; the latter
        also without a predictor of the caller if nothing prescribed moves, as where a body is let go."""
        known = step.prescribed
        stays = bool(np.abs(known.values - self.u[known.degrees]).max(initial=0.0) <= _STAYS * self.body.mesh.size)
        plain = [carried] if stays or self.guess is not None or step.inertia is not None else []
        if self.correction_rate is None:
            return plain
        return [carried + _PART * (step.time - step.before) * self.correction_rate.reshape(-1), *plain]

    def _end(self, status: SolveStatus, reached: list[ContactInstant], message: str, step: LoadStep) -> ContactSolution:
        if not reached:
            zero = np.zeros((len(self.body.mesh.nodes), 3))
            reached = [ContactInstant(self.start, self.u.reshape(-1, 3), zero, (), 0, 0, 0.0)]
        states, more = tuple(self.states), (self.correction_rate, self.last_step, self.budget.spent, self.pressed)
        return ContactSolution(status, tuple(reached), message, states, tuple(self.steps), step.loads, *more)
