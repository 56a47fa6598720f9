"""Quasi-static contact problems over time: entry point of the contact solvers (B §3.4, R108–R113, R122, R126)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.paper.loop import by_turns
from warpjld.fem.contact.results.contact_solution import ContactError, ContactInstant, ContactSolution, ContactWarning
from warpjld.fem.contact.solver.load_steps import Guess, LoadSteps
from warpjld.fem.contact.solver.unresolved import unresolved
from warpjld.fem.load.inertia import Dynamics
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.rotation import warn_of_rotation
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.runtime.threads import one_blas_thread

__all__ = ["press"]


@one_blas_thread()
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
    halvings: int | None = None,
    solves: int | None = None,
    check: bool = True,
    dynamics: Dynamics | None = None,
    progress: Callable[[str], None] | None = None,
) -> ContactSolution:
    """Equilibria of bodies in contact at ascending times, or their motion with inertia.

    Initial overlaps are removed gradually up to the first time (R112). Load steps that fail are halved; steps longer
    than contact search can follow, and steps in which frictional contact begins, are cut. Bodies that would pass
    through each other, or lie deep inside each other without contact, end the run with ``SolveStatus.PASSED``.

    Args:
        body: All bodies, merged into one mesh.
        prescribed: Dirichlet conditions at the last time, applied in proportion to time; or a function of time.
        pairs: Contact pairs.
        loads: Loads at the last time, applied in proportion to time; or a function of time.
        times: Ascending times, above 0 (or above the last of ``after``), at which equilibria are returned.
        after: Solution to continue from.
        method: ``augmented``: augmented Lagrangian method, bodies and contact solved together
            (``contact.solver``); ``paper``: the paper's staggered loop, in which slave nodes are repelled by the master
            and both are released (R113; ``contact.paper.loop`` tells when it converges).
        aitken: Whether the paper's loop uses Aitken relaxation.
        tolerance: Residual relative to the forces in balance.
        penetration: Admissible penetration, relative to an element edge.
        guess: Predictor of the displacement.
        watch: Called after each instant; a returned text ends the run with ``SolveStatus.STOPPED`` (R118).
        halvings: Most successive halvings of a failing load step; by default 7, or 3 for an unheld body.
        solves: Most linear solves of the run, after which it ends with ``SolveStatus.EXHAUSTED``; by default only those
            in vain are bounded, for each time. Not used by ``paper``.
        check: Whether to raise if the last time is not reached, instead of returning the status.
        dynamics: Motion at the start: bodies then move with inertia, by implicit Euler steps between the times
            (``fem.load.inertia``), and instants have velocities. Not with ``paper``.
        progress: Called with a line of text after each instant.

    Raises:
        InputError: Wrong arguments.
        ContactError: The last time was not reached; its ``solution`` holds the instants found.
    """
    wanted = _rising(times, 0.0 if after is None else after.last.time)
    for name, value in (("tolerance", tolerance), ("penetration", penetration)):
        if not 0.0 < value < 1.0:
            raise InputError(f"{name}: want a share between 0 and 1, got {value}")
    if after is not None and len(after.states) != len(pairs):
        raise InputError(f"after: was found with {len(after.states)} pairs, not {len(pairs)}")
    if method not in ("augmented", "paper"):
        raise InputError(f"method: want augmented or paper, got '{method}'")
    for name, most in (("halvings", halvings), ("solves", solves)):
        if most is not None and most < 0:
            raise InputError(f"{name}: want 0 or more, got {most}")
    if isinstance(loads, Loads) and loads.drag is not None and np.shape(loads.drag) != (len(body.mesh.nodes),):
        raise InputError(f"loads: drag wants {len(body.mesh.nodes)} values, got shape {np.shape(loads.drag)}")
    if method == "paper" and dynamics is not None:
        raise InputError("dynamics: the paper's loop knows no inertia; want the method augmented")
    if method == "paper":
        solution = by_turns(body, prescribed, pairs, loads, wanted, after, aitken, penetration, guess, watch, progress)
    else:
        known = (body, prescribed, list(pairs), loads, wanted, after, tolerance, penetration, guess)
        steps = LoadSteps(*known, halvings, solves, dynamics)
        solution = steps.run(watch, progress)
        last = solution.last
        sides = (body.mesh.nodes, steps.interfaces, steps.moduli, steps.passing)
        for words in unresolved(*sides, last, steps.allowed(last.time)):
            warnings.warn(words, ContactWarning, stacklevel=3)
    warn_of_rotation(body, solution.last.displacement)
    if check and not solution.converged and solution.status is not SolveStatus.STOPPED:
        raise ContactError(solution)
    return solution


def _rising(times: Sequence[float], first: float) -> list[float]:
    """Times as floats.

    Raises:
        InputError: Times that are not finite, not ascending or not above ``first``.
    """
    wanted = [float(t) for t in times]
    rising = all(a < b for a, b in zip([first, *wanted], wanted, strict=False))
    if not wanted or not np.isfinite(wanted).all() or not rising:
        raise InputError(f"times: want rising times above {first:g}, got {list(times)}")
    return wanted
