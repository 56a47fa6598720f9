"""Staggered contact of the paper: objects are repelled by the skin, then both are released (B Fig. 9, R113).

1. The bones are prescribed. 2. Penetrating slave nodes are moved onto the master's polygons, and the master's surface
is fixed. 3. K11 U_u = R_k − K12 U_k is solved and gives the reactions (Dirichlet step). 4. Each reaction is applied,
equal and opposite, to the three nodes of the facet that repelled the node, by barycentric weights. 5. With these forces
known, both bodies are released and solved for (Neumann step). Steps 2–5 are repeated until no point moves any more.

It is a fixed-point iteration of the contact forces, f → F(f), whose slope is mainly the ratio of the slave's stiffness
to the master's. So it converges if the skin is the stiffer of the two, faster the stiffer it is, and oscillates for
ever otherwise. Aitken relaxation releases the bodies under f + ω (F(f) − f) instead, with ω from the last two
iterations (Küttler & Wall 2008), and converges in both cases. Iterations ("turns") per time step to a thousandth of an
edge (–: not within 60):

| skin over object, modulus | 0.1 | 0.2 | 0.5 | 1 | 2 | 5 | 10 |
|---|---|---|---|---|---|---|---|
| blocks pressed by a tenth of their height, plain | – | – | – | – | 8 | 4 | 4 |
| the same, Aitken | 10–12 | 9–15 | 6 | 5 | 3–5 | 3–5 | 3–4 |
| balls, by 0.3 radii, plain | – | | | 18–36 | | | 3–4 |
| the same, Aitken | 6–16 | | | 4–6 | | | 3–4 |
| finger on a plate, 1 mm, plain | – | | – | 19–26 | 7 | | 3–4 |
| the same, Aitken | 7–13 | | 6 | 5 | 4–5 | | 3–5 |

A fingertip of the built-in hand on a rigid plate takes 2 to 4 turns, the hand on a ball (0.4 MPa) 14 to 29 with Aitken.
Nodes are repelled by no more than a fraction of an edge at once: with deeper overlaps the time step is halved, as it is
if repelled or released bodies have no equilibrium. There is no friction (R122; while repelled, nodes stick), no bonds
and no self-contact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.paper.sides import Side
from warpjld.fem.contact.paper.turns import Turns
from warpjld.fem.contact.results.contact_solution import ContactInstant, ContactSolution
from warpjld.fem.load.loads import Loads, external_forces
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.fem.solver.solution import Instant, Solution

__all__ = ["by_turns"]

_CAUTION = 0.25
"""First relaxation factor for two sides of equal stiffness."""
_REPEL = 0.25
"""Largest overlap, in element edges, by which nodes are repelled at once; with more, the time step is halved."""
_HALVINGS = 5
"""Most successive halvings of a time step."""
_ADVICE = {
    False: "it converges if the skin is the stiffer body; else use Aitken relaxation, or the default method",
    True: "take shorter steps in time, or use the default method",
}


def by_turns(
    body: Body,
    prescribed: Prescribed | Callable[[float], Prescribed],
    pairs: Sequence[Pair],
    loads: Loads | Callable[[float], Loads] | None,
    times: list[float],
    after: ContactSolution | None = None,
    aitken: bool = False,
    threshold: float = 1e-3,
    guess: Callable[[float, float, Array], Array] | None = None,
    watch: Callable[[ContactInstant], str | None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> ContactSolution:
    """Instants by the paper's loop; arguments as in ``press``.

    ``threshold`` is the convergence tolerance: largest motion of a point in a turn, in element edges.
    """
    _refuse(pairs)

    def load(time: float) -> Loads:
        return loads(time) if callable(loads) else (loads or Loads()).scaled(time / times[-1])

    sides = [Side(body, pair) for pair in pairs]
    edge = min(float(side.slave.edge.min()) for side in sides)
    omega = _first_omega(body, sides) if aitken else 1.0
    now = 0.0 if after is None else after.last.time
    last, forces = _begun(body, sides, load, after)
    reached: list[ContactInstant] = []
    steps: list[int] = []
    report = progress or (lambda text: None)
    begun = last.last
    status, message = SolveStatus.CONVERGED, SolveStatus.CONVERGED.value
    todo, halvings = list(times), 0
    while todo:
        time = todo[0]
        held = prescribed(time) if callable(prescribed) else prescribed.scaled(time / times[-1])
        first = None if guess is None else guess(now, time, last.displacement)
        touched = [side.touching.copy() for side in sides]
        turns = Turns(body, held, sides, load(time), time, forces, omega if aitken else None, edge * threshold)
        status = turns.through(last, first, _REPEL * edge if halvings < _HALVINGS else np.inf)
        report(f"time {time:.3g}: {turns.report}")
        if status is not SolveStatus.CONVERGED:
            halvings += 1
            if halvings > _HALVINGS or turns.diverged:  # shorter steps do not help against divergence
                message = f"at time {time:.4g} (from {now:.4g}): {turns.report}; {_ADVICE[aitken]}"
                break
            for side, touching in zip(sides, touched, strict=True):
                side.touching = touching
            todo.insert(0, 0.5 * (now + time))
            continue
        steps.append(turns.solves)
        last, now, forces, omega = turns.last, time, turns.forces, turns.omega
        todo.pop(0)
        halvings = max(0, halvings - 1)
        if time in times:
            reached.append(turns.instant())
            if reason := watch(reached[-1]) if watch else None:
                status, message = SolveStatus.STOPPED, reason
                break
    if not reached:
        reached = [ContactInstant(now, begun.displacement, begun.reactions, (), 0, 0, 0.0)]
    states = tuple(side.state() for side in sides)
    return ContactSolution(status, tuple(reached), message, states, tuple(steps), load(reached[-1].time))


def _begun(
    body: Body, sides: list[Side], loads: Callable[[float], Loads], after: ContactSolution | None
) -> tuple[Solution, Array]:
    """Solution from which the first step starts, and its contact forces [N], shape (N, 3)."""
    zero = np.zeros_like(body.mesh.nodes)
    at, forces = Instant(1.0, zero, zero, 0, 0, 0.0), np.zeros_like(zero)
    if after is not None:
        at = replace(at, displacement=after.last.displacement)
        forces = _missing(body, loads(after.last.time), after.last)
        for side, known in zip(sides, after.states, strict=True):
            side.touching = known.pressure > 0.0
    return Solution(SolveStatus.CONVERGED, (at,), "", np.empty(0, np.int64), loads(0.0)), forces


def _refuse(pairs: Sequence[Pair]) -> None:
    """Reject pairs with features that the paper's loop lacks.

    Raises:
        InputError: Self-contact, friction, bonds or offsets.
    """
    for what, asked in (
        ("supports no self-contact", any(pair.exclusion is not None for pair in pairs)),
        ("supports neither friction nor bonds", any(pair.friction > 0.0 or pair.bond is not None for pair in pairs)),
        ("supports no offsets", any(pair.offset is not None for pair in pairs)),
    ):
        if asked:
            raise InputError(f"pairs: the paper's loop {what}; use method='augmented'")


def _missing(body: Body, loads: Loads, at: ContactInstant) -> Array:
    """Contact forces of an instant [N], shape (N, 3): internal forces minus loads and reactions."""
    internal = body.at(at.displacement, stiffness=False).forces.reshape(-1, 3)
    return np.asarray(
        internal - at.reactions - external_forces(body, loads, at.displacement.reshape(-1)).reshape(-1, 3)
    )


def _first_omega(body: Body, sides: list[Side]) -> float:
    """First relaxation factor: smaller the stiffer the slave, for which the master overshoots; 1 for obstacles."""
    stiffness = body.at().stiffness
    assert stiffness is not None
    stiff = np.einsum("nii->n", stiffness.diagonal())
    out = 1.0
    for side in sides:
        if len(side.nodes):
            out = min(
                out, _CAUTION * min(1.0, float(np.median(stiff[side.nodes]) / np.median(stiff[side.slave.nodes])))
            )
    return out
