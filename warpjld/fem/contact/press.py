"""Bodies pressed against each other and against obstacles, through time (B §3.4, R108–R113, R122, R126)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.conjugate import Status
from warpjld.fem.contact.blocked import blocked
from warpjld.fem.contact.border import contact_modulus
from warpjld.fem.contact.equilibrium import Equilibrium
from warpjld.fem.contact.law import Memory, start_memory
from warpjld.fem.contact.pairs import Pair
from warpjld.fem.contact.points import Interface, interfaces_of
from warpjld.fem.contact.solution import ContactError, ContactInstant, ContactSolution
from warpjld.fem.contact.step import Step
from warpjld.fem.contact.touches import touch_of
from warpjld.fem.contact.walk import Reached
from warpjld.fem.loads import Loads
from warpjld.fem.prescribed import Prescribed

__all__ = ["press"]

_HALVINGS = 7
_HALVINGS_UNHELD = 3
"""A body that slides away, or falls, seldom does so because the step is long."""
_BREAKS = 100
_PART = 0.85
"""How far along the course of the step before a first guess goes: contact stiffens what it meets."""
_METHODS = ("augmented", "paper")

Guess = Callable[[float, float, NDArray[np.float64]], NDArray[np.float64]]
"""Time before, time, displacement before (N, 3) → where to begin to look for the displacement at the time (N, 3)."""


def press(
    body: Body,
    prescribed: Prescribed | Callable[[float], Prescribed],
    pairs: Sequence[Pair],
    loads: Loads | Callable[[float], Loads] | None = None,
    *,
    times: Sequence[float] = (1.0,),
    after: ContactSolution | None = None,
    method: str = "augmented",
    aitken: bool = False,
    tolerance: float = 1e-5,
    penetration: float = 1e-3,
    guess: Guess | None = None,
    watch: Callable[[ContactInstant], str | None] | None = None,
    check: bool = True,
    progress: Callable[[str], None] | None = None,
) -> ContactSolution:
    """Equilibria of bodies in contact at rising times.

    Bodies that only contact holds need no other hold. Surfaces that overlap at the start are parted gradually up to
    the first time (R112). A step that fails is taken in halves.

    Args:
        body: All bodies, merged into one mesh.
        prescribed: Known displacements from rest at the last time, reached in proportion to time; or a function of
            time.
        pairs: What may touch what.
        loads: Loads at the last time, reached in proportion to time; or a function of time.
        times: Rising times above 0 (above ``after``'s) to find equilibria at.
        after: Contact and displacement to go on from.
        method: ``augmented`` (Lagrangian, on bodies and contact together), or ``paper``: objects repelled by the skin
            and released, in turns (R113; see ``warpjld.fem.contact.paper`` for when it settles). The slave is repelled.
        aitken: Relax the paper's loop.
        tolerance: Residual over the forces that balance.
        penetration: Overlap left, as a share of an edge.
        guess: Where to begin to look.
        watch: Asked after each instant; a text ends the run there with ``Status.STOPPED`` (R118).
        check: Raise where the last time is not reached; otherwise return the status.
        progress: Called with a line of text after each instant.

    Raises:
        InputError: Wrong arguments.
        ContactError: The last time was not reached; its ``solution`` has what was.
    """
    wanted = [float(t) for t in times]
    first = 0.0 if after is None else after.last.time
    if (
        not wanted
        or not np.isfinite(wanted).all()
        or any(b <= a for a, b in zip([first, *wanted], wanted, strict=False))
    ):
        raise InputError(f"times: want rising times above {first:g}, got {list(times)}")
    for name, value in (("tolerance", tolerance), ("penetration", penetration)):
        if not 0.0 < value < 1.0:
            raise InputError(f"{name}: want a share between 0 and 1, got {value}")
    if after is not None and len(after.memory) != len(pairs):
        raise InputError(f"after: was found with {len(after.memory)} pairs, not {len(pairs)}")
    if method not in _METHODS:
        raise InputError(f"method: want {' or '.join(_METHODS)}, got '{method}'")
    if method == "paper":
        solution = _by_turns(body, prescribed, pairs, loads, wanted, after, aitken, penetration, guess, watch, progress)
    else:
        run = _Run(body, prescribed, list(pairs), loads, wanted, after, tolerance, penetration, guess)
        solution = run.through(watch, progress)
    if check and not solution.converged and solution.status is not Status.STOPPED:
        raise ContactError(solution)
    return solution


def _by_turns(
    body: Body,
    prescribed: Prescribed | Callable[[float], Prescribed],
    pairs: Sequence[Pair],
    loads: Loads | Callable[[float], Loads] | None,
    times: list[float],
    after: ContactSolution | None,
    aitken: bool,
    threshold: float,
    guess: Guess | None,
    watch: Callable[[ContactInstant], str | None] | None,
    progress: Callable[[str], None] | None,
) -> ContactSolution:
    from warpjld.fem.contact.paper import by_turns

    if any(pair.exclusion is not None for pair in pairs):
        raise InputError("pairs: the paper's loop does not know a surface that meets itself; use method='augmented'")
    if any(pair.friction > 0.0 or pair.bond is not None for pair in pairs):
        raise InputError("pairs: the paper's loop knows neither friction nor bonds; use method='augmented'")

    if any(pair.offset is not None for pair in pairs):
        raise InputError("pairs: the paper's loop knows no offsets; use method='augmented'")

    def known(time: float) -> Prescribed:
        return prescribed(time) if callable(prescribed) else prescribed.scaled(time / times[-1])

    def load(time: float) -> Loads:
        return loads(time) if callable(loads) else (loads or Loads()).scaled(time / times[-1])

    return by_turns(
        body,
        known,
        pairs,
        load,
        times,
        after=after,
        aitken=aitken,
        threshold=threshold,
        guess=guess,
        watch=watch,
        progress=progress,
    )


class _Run:
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
        guess: Guess | None,
    ) -> None:
        self.body = body
        self.times = times
        self.prescribed = prescribed
        self.loads = loads or Loads()
        self.guess = guess
        self.penetration = penetration
        self.interfaces = interfaces_of(body.mesh, pairs, body.threads)
        self.moduli = [contact_modulus(body, interface) for interface in self.interfaces]
        self.equilibrium = Equilibrium(body, self.interfaces, self.moduli, tolerance=tolerance, penetration=penetration)
        if after is None:
            self.start = 0.0
            self.u = np.zeros(body.degrees)
            self.memory = [self._begin(interface) for interface in self.interfaces]
        else:
            if after.last.displacement.size != body.degrees:
                raise InputError(f"after: is of a body with {after.last.displacement.size} degrees of freedom")
            self.start = after.last.time
            self.u = after.last.displacement.reshape(-1).copy()
            self.memory = list(after.memory)
        self.steps: list[int] = []
        self.course = None if after is None else after.course

    def _begin(self, interface: Interface) -> Memory:
        """Bonds made, and the overlap noted that there is at the start."""
        memory = start_memory(len(interface.edge), interface.pair)
        points = interface.points(self.body.mesh.nodes, 0.0, 0.0)
        if interface.pair.bond is not None:
            memory.seam[points.sites] = points.gap
            if len(points.sites) == 0:
                raise InputError(f"{interface.pair.title}: a bond to nothing: its two sides do not meet")
            memory.bonded[np.isnan(memory.seam)] = False
        else:
            memory.allowance[points.sites] = np.maximum(-points.gap, 0.0)
        return memory

    def step(self, before: float, time: float) -> Step:
        share = time / self.times[-1]
        known = self.prescribed
        now = known(time) if callable(known) else known.scaled(share)
        loads = self.loads(time) if callable(self.loads) else self.loads.scaled(share)
        allowed = max(0.0, 1.0 - (time - self.start) / (self.times[0] - self.start))
        return Step(before, time, now, loads, allowed)

    def through(
        self,
        watch: Callable[[ContactInstant], str | None] | None,
        progress: Callable[[str], None] | None,
    ) -> ContactSolution:
        now, halvings = self.start, 0
        reached: list[ContactInstant] = []
        todo = list(self.times)
        solves, iterations = 0, 0
        while todo:
            target = todo[0]
            self.equilibrium.solves = self.equilibrium.iterations = 0
            step = self.step(now, target)
            carried = self._carried(step)
            status, found = self._find(step, carried)
            solves += self.equilibrium.solves
            iterations += self.equilibrium.iterations
            if overlap := self._blocked(step, found):
                message = f"no equilibrium at time {target:.4g}: {overlap}; no force can part them"
                return self._end(Status.BLOCKED, reached, message, step)
            if found is None:
                halvings += 1
                unheld = status in (Status.SLIDING, Status.UNHELD)
                if halvings > (_HALVINGS_UNHELD if unheld else _HALVINGS):
                    reason = self.equilibrium.trouble if unheld else status.value
                    message = f"no equilibrium found after time {now:.4g} (tried {target:.4g}): {reason}"
                    return self._end(status, reached, message, step)
                if progress:
                    progress(f"time {target:.3g}: {status.value}; halving the step")
                todo.insert(0, 0.5 * (now + target))
                continue
            self.steps.append(self.equilibrium.solves)
            self.course = (found.displacement - carried).reshape(-1, 3) / (target - now)
            self.u, self.memory, now = found.displacement, found.memory, target
            todo.pop(0)
            halvings = max(0, halvings - 1)
            if target not in self.times:
                continue
            instant = self._instant(target, found, solves, iterations)
            reached.append(instant)
            if progress:
                progress(f"time {target:.3g}: {solves} solves, {iterations} iterations, residual {found.residual:.1e}")
            solves = iterations = 0
            wish = watch(instant) if watch else None
            if wish:
                return self._end(Status.STOPPED, reached, wish, step)
        return self._end(Status.CONVERGED, reached, Status.CONVERGED.value, step)

    def _blocked(self, step: Step, found: Reached | None) -> str:
        """Overlap that nothing can part, in words; looked for where a step failed, or ended with an overlap."""
        if found is None:
            u = self.u.copy()
            u[step.prescribed.degrees] = step.prescribed.values
            x = self.body.mesh.nodes + u.reshape(-1, 3)
            points = [interface.points(x, step.before, step.time) for interface in self.interfaces]
        else:
            points = found.points
        return blocked(
            self.interfaces,
            points,
            self.memory,
            step.prescribed.free(self.body.degrees),
            allowed=step.allowed,
            penetration=self.penetration,
        )

    def _find(self, step: Step, carried: NDArray[np.float64]) -> tuple[Status, Reached | None]:
        """Equilibrium of a step; again after every bond that did not hold."""
        first = self._first(step, carried)
        status, found = self.equilibrium.find(self.u, self.memory, step, first)
        if found is None and first is not None and self.guess is None:
            status, found = self.equilibrium.find(self.u, self.memory, step)
        memory = self.memory
        for _ in range(_BREAKS):
            if found is None:
                return status, None
            broken = [_overstrained(i, f, found) for i, f in enumerate(self.interfaces)]
            if not any(mask.any() for mask in broken):
                return status, found
            memory = [replace(m, bonded=m.bonded & ~mask) for m, mask in zip(found.memory, broken, strict=True)]
            memory = [_released(m, mask) for m, mask in zip(memory, broken, strict=True)]
            status, found = self.equilibrium.find(self.u, memory, step, found.displacement)
        return Status.MAX_ITERATIONS, None

    def _carried(self, step: Step) -> NDArray[np.float64]:
        """The displacement that a step begins from, carried on as the caller knows how, shape (3N,)."""
        if self.guess is None:
            return self.u
        return np.asarray(self.guess(step.before, step.time, self.u.reshape(-1, 3)), dtype=np.float64).reshape(-1)

    def _first(self, step: Step, carried: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Where to begin: as asked, and what it was off by in the step before is taken to be off by again."""
        if self.course is None:
            return None if self.guess is None else carried
        first: NDArray[np.float64] = carried + _PART * (step.time - step.before) * self.course.reshape(-1)
        if not self.body.large_strain or bool((self.body.at(first, stiffness=False).lowest > 0.0).all()):
            return first
        return None if self.guess is None else carried

    def _instant(self, time: float, found: Reached, solves: int, iterations: int) -> ContactInstant:
        x = self.body.mesh.nodes + found.displacement.reshape(-1, 3)
        touches = []
        for k, interface in enumerate(self.interfaces):
            bonded = found.memory[k].bonded
            points, response, slip = found.points[k], found.responses[k], found.slips[k]
            touches.append(touch_of(interface, points, response, slip, bonded, self.moduli[k], x))
        shape = (-1, 3)
        return ContactInstant(
            time,
            found.displacement.reshape(shape),
            found.reactions.reshape(shape),
            tuple(touches),
            solves,
            iterations,
            found.residual,
        )

    def _end(self, status: Status, reached: list[ContactInstant], message: str, step: Step) -> ContactSolution:
        if not reached:
            nothing = np.zeros((len(self.body.mesh.nodes), 3))
            reached = [ContactInstant(self.start, self.u.reshape(-1, 3), nothing, (), 0, 0, 0.0)]
        memory, steps = tuple(self.memory), tuple(self.steps)
        return ContactSolution(status, tuple(reached), message, memory, steps, step.loads, self.course)


def _overstrained(k: int, interface: Interface, found: Reached) -> NDArray[np.bool_]:
    """Nodes whose bond does not hold, shape (m,)."""
    memory, points, response = found.memory[k], found.points[k], found.responses[k]
    out = np.zeros(len(memory.bonded), dtype=bool)
    bond = interface.pair.bond
    if bond is not None:
        pull = -response.pressure > bond.normal
        shear = np.linalg.norm(response.friction, axis=1) > bond.shear
        out[points.sites] = (pull | shear) & memory.bonded[points.sites]
    return out


def _released(memory: Memory, broken: NDArray[np.bool_]) -> Memory:
    """No pull across what has parted."""
    pressure = np.where(broken, np.maximum(memory.pressure, 0.0), memory.pressure)
    friction = np.where(broken[:, None], 0.0, memory.friction)
    return replace(memory, pressure=pressure, friction=friction)
