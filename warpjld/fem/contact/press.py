"""Bodies pressed against each other and against obstacles, through time (B §3.4, R108–R113, R122, R126)."""

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
    check: bool = True,
    progress: Callable[[str], None] | None = None,
) -> ContactSolution:
    """Equilibria of bodies in contact at rising times.

    Surfaces that overlap at the start are parted gradually up to the first time (R112). Steps that fail are halved;
    those longer than contact can follow, and those in which friction first takes hold, are cut. Bodies that would pass
    through each other, or lie deep in one another with nothing to part them, end the run with ``Status.PASSED``.

    Args:
        body: All bodies, merged into one mesh.
        prescribed: Known displacements from rest at the last time, reached in proportion to it; or a function of time.
        pairs: What may touch what.
        loads: Loads at the last time, reached in proportion to time; or a function of time.
        times: Rising times above 0 (above ``after``'s) to find equilibria at.
        after: Contact and displacement to go on from.
        method: ``augmented`` (Lagrangian, on bodies and contact together), or ``paper``: objects repelled by the skin
            and released, in turns (R113; ``contact.paper.loop`` says when it settles). The slave is repelled.
        aitken: Relax the paper's loop.
        tolerance, penetration: Residual over the forces that balance; overlap left, as a share of an edge.
        guess: Where to begin to look.
        watch: Asked after each instant; a text ends the run there with ``Status.STOPPED`` (R118).
        halvings: How often a step that fails may be halved, and its halves again; by default as long as it may help.
        check: Raise where the last time is not reached; otherwise return the status.
        progress: Called with a line of text after each instant.

    Raises:
        InputError, ContactError: Wrong arguments; the last time not reached (``solution`` has what was).
    """
    wanted = _rising(times, 0.0 if after is None else after.last.time)
    for name, value in (("tolerance", tolerance), ("penetration", penetration)):
        if not 0.0 < value < 1.0:
            raise InputError(f"{name}: want a share between 0 and 1, got {value}")
    if after is not None and len(after.states) != len(pairs):
        raise InputError(f"after: was found with {len(after.states)} pairs, not {len(pairs)}")
    if method not in ("augmented", "paper"):
        raise InputError(f"method: want augmented or paper, got '{method}'")
    if halvings is not None and halvings < 0:
        raise InputError(f"halvings: want 0 or more, got {halvings}")
    if method == "paper":
        solution = by_turns(body, prescribed, pairs, loads, wanted, after, aitken, penetration, guess, watch, progress)
    else:
        way = LoadSteps(body, prescribed, list(pairs), loads, wanted, after, tolerance, penetration, guess, halvings)
        solution = way.run(watch, progress)
        last = solution.last
        for words in unresolved(body.mesh.nodes, way.interfaces, way.passing, last, way.allowed(last.time)):
            warnings.warn(words, ContactWarning, stacklevel=3)
    warn_of_rotation(body, solution.last.displacement)
    if check and not solution.converged and solution.status is not SolveStatus.STOPPED:
        raise ContactError(solution)
    return solution


def _rising(times: Sequence[float], first: float) -> list[float]:
    wanted = [float(t) for t in times]
    rising = all(a < b for a, b in zip([first, *wanted], wanted, strict=False))
    if not wanted or not np.isfinite(wanted).all() or not rising:
        raise InputError(f"times: want rising times above {first:g}, got {list(times)}")
    return wanted
