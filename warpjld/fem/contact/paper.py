"""The paper's loop: objects are repelled by the skin, then both are released under the forces found (B Fig. 9, R113).

1. The bones are prescribed. 2. Slave nodes that overlap are put onto the master's polygons, the master's surface is
held. 3. K11 U_u = R_k − K12 U_k and the reactions. 4. Each reaction goes, equal and opposite, to the three nodes of the
facet that repelled it, by barycentric weights. 5. The forces are taken as known, both bodies are released and solved
for. Steps 2–5 are repeated until no point moves any more.

It is a fixed point of the contact forces, f → F(f), whose slope is, in the main, that of the slave's stiffness over the
master's. So it settles where the skin is the stiffer of the two, faster the stiffer it is, and elsewhere goes to and
fro for ever. Aitken's relaxation releases bodies under f + ω (F(f) − f) instead, ω from the last two turns (Küttler &
Wall 2008), and settles both. Turns to a thousandth of an edge, a step in time (– is never, in 60):

| skin over object, modulus | 0.1 | 0.2 | 0.5 | 1 | 2 | 5 | 10 |
|---|---|---|---|---|---|---|---|
| blocks pressed by a tenth of their height, plain | – | – | – | – | 8 | 4 | 4 |
| the same, Aitken | 10–12 | 9–15 | 6 | 5 | 3–5 | 3–5 | 3–4 |
| balls, by 0.3 radii, plain | – | | | 18–36 | | | 3–4 |
| the same, Aitken | 6–16 | | | 4–6 | | | 3–4 |
| finger on a plate, 1 mm, plain | – | | – | 19–26 | 7 | | 3–4 |
| the same, Aitken | 7–13 | | 6 | 5 | 4–5 | | 3–5 |

A fingertip of the built-in hand on a rigid plate takes 2 to 4 turns, the hand on a ball (0.4 MPa) 14 to 29 with Aitken.
Nodes are repelled by no more than a share of an edge at once: where bodies come to overlap by more, the step in time is
halved, as it is where repelled or released bodies find no equilibrium. Friction is not in it (R122): while repelled,
nodes stick. Nor are bonds, nor a surface that meets itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.body import Body
from warpjld.fem.conjugate import Status
from warpjld.fem.contact.facets import Facets, Place
from warpjld.fem.contact.imprint import imprint_of
from warpjld.fem.contact.law import Memory, start_memory
from warpjld.fem.contact.obstacles import Obstacle
from warpjld.fem.contact.pairs import Pair
from warpjld.fem.contact.solution import ContactInstant, ContactSolution, Touch
from warpjld.fem.contact.surface import ContactSurface, surface_of
from warpjld.fem.loads import Loads, external_forces
from warpjld.fem.prescribed import Prescribed
from warpjld.fem.solution import Instant, Solution
from warpjld.fem.static import solve

__all__ = ["by_turns"]

_TURNS = 60
_CAUTION = 0.25
"""First relaxation where the two sides are as stiff as one another."""
_LEAST, _MOST = 0.1, 2.0
"""Factors by which it may change in a turn."""
_DEEPEST = 5.0
"""Overlap, over an edge, beyond which a node is taken to have another side of the master behind it."""
_REPEL = 0.25
"""Overlap, over an edge, that nodes are repelled by at once; where there is more, the step in time is halved."""
_HALVINGS = 5
_RUNAWAY = 1e3
"""Growth of the move from its least that is called divergence."""
_ADVICE = {
    False: "it settles where the skin is the stiffer body; else relax it after Aitken, or use the default method",
    True: "take shorter steps in time, or use the default method",
}


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Where a pair's slave nodes are repelled to."""

    rows: NDArray[np.int64]
    target: NDArray[np.float64]
    normal: NDArray[np.float64]
    place: Place | None
    distance: NDArray[np.float64]


class _Side:
    """A pair, its surfaces, and which slave nodes are pushed."""

    def __init__(self, body: Body, pair: Pair) -> None:
        self.pair = pair
        self.slave: ContactSurface = surface_of(body.mesh, pair.slave, f"{pair.title}: slave")
        self.touching = np.zeros(len(self.slave.nodes), dtype=bool)
        self.obstacle = pair.master if isinstance(pair.master, Obstacle) else None
        self.nodes = np.empty(0, np.int32)
        if not isinstance(pair.master, Obstacle):
            master = surface_of(body.mesh, pair.master, f"{pair.title}: master")
            self.nodes = master.nodes
            corners = master.corners
            self._facets = Facets(body.mesh.nodes[self.nodes], np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]]))
            self.triangles = self._facets.faces

    def memory(self) -> Memory:
        """Who was pushed, for a later run: nodes with a pressure."""
        return replace(start_memory(len(self.slave.nodes), self.pair), pressure=self.touching.astype(np.float64))

    def meet(self, x: NDArray[np.float64], skin: NDArray[np.float64], time: float) -> _Meeting:
        """Nodes that overlap or were pushed, at positions x (N, 3), and the polygons of ``skin`` (N, 3) under them."""
        place = None
        points = x[self.slave.nodes]
        if self.obstacle is not None:
            found = self.obstacle.project(points, time)
        else:
            self._facets.move(skin[self.nodes])
            found, place = self._facets.locate(points)
        # by the side of the nearest polygon: a master need not be closed
        depth = np.einsum("mi,mi->m", found.closest - points, found.normal)
        overlapping = (depth > 0.0) & (depth < _DEEPEST * self.slave.edge)
        rows = np.flatnonzero(overlapping | self.touching)
        if place is not None:
            place = Place(place.face[rows], place.weights[rows])
        return _Meeting(rows, found.closest[rows], found.normal[rows], place, -depth[rows])

    def share(self, meeting: _Meeting, reactions: NDArray[np.float64], out: NDArray[np.float64]) -> NDArray[np.float64]:
        """Add forces on slave nodes (m, 3), and their opposites on the facets' nodes, to ``out`` (N, 3); what pulls is
        let go. The forces that stay, shape (m, 3).
        """
        pushes = np.einsum("mi,mi->m", reactions, meeting.normal) > 0.0
        forces = reactions * pushes[:, None]
        self.touching[:] = False
        self.touching[meeting.rows[pushes]] = True
        np.add.at(out, self.slave.nodes[meeting.rows], forces)
        if meeting.place is not None:
            corners = self.nodes[self.triangles[meeting.place.face]]
            np.add.at(out, corners, -meeting.place.weights[:, :, None] * forces[:, None, :])
        return forces


def by_turns(
    body: Body,
    prescribed: Callable[[float], Prescribed],
    pairs: Sequence[Pair],
    loads: Callable[[float], Loads],
    times: Sequence[float],
    *,
    after: ContactSolution | None = None,
    aitken: bool = False,
    threshold: float = 1e-3,
    guess: Callable[[float, float, NDArray[np.float64]], NDArray[np.float64]] | None = None,
    watch: Callable[[ContactInstant], str | None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> ContactSolution:
    """Instants by the paper's loop.

    Args:
        body: All bodies, merged.
        prescribed: Known displacements as a function of time.
        pairs: Slave nodes are repelled by master facets.
        loads: Loads as a function of time.
        times: Rising times.
        after: Displacements and forces to go on from.
        aitken: Relax the master's surface after Aitken (Küttler & Wall 2008).
        threshold: Move of any point, over an edge, below which it has settled.
        guess: Where step 1 begins to look for the bodies; see ``press``.
        watch: See ``press``.
        progress: See ``press``.
    """
    sides = [_Side(body, pair) for pair in pairs]
    edge = min(float(side.slave.edge.min()) for side in sides)
    reached: list[ContactInstant] = []
    steps: list[int] = []
    now, last = 0.0, Solution(Status.CONVERGED, (_at_rest(body),), "", np.empty(0, np.int64), loads(0.0))
    forces, omega = np.zeros_like(body.mesh.nodes), _first_omega(body, sides) if aitken else 1.0
    if after is not None:
        now = after.last.time
        last = replace(last, instants=(replace(_at_rest(body), displacement=after.last.displacement),))
        forces = _missing(body, loads(now), after.last)
        for side, known in zip(sides, after.memory, strict=True):
            side.touching = known.pressure > 0.0
    begun = last.last
    status, message = Status.CONVERGED, Status.CONVERGED.value
    todo, halvings = [float(time) for time in times], 0
    while todo:
        time = todo[0]
        first = None if guess is None else guess(now, time, last.displacement)
        touched = [side.touching.copy() for side in sides]
        deepest = _REPEL * edge if halvings < _HALVINGS else np.inf
        turns = _Turns(
            body, prescribed(time), sides, loads(time), time, forces, omega if aitken else None, edge * threshold
        )
        status = turns.through(last, first, deepest)
        if progress:
            progress(f"time {time:.3g}: {turns.report}")
        if status is not Status.CONVERGED:
            halvings += 1
            if halvings > _HALVINGS or turns.diverged:  # that, shorter steps do not change
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
        if time not in times:
            continue
        reached.append(turns.instant())
        reason = watch(reached[-1]) if watch else None
        if reason:
            status, message = Status.STOPPED, reason
            break
    if not reached:
        reached = [ContactInstant(now, begun.displacement, begun.reactions, (), 0, 0, 0.0)]
    memory = tuple(side.memory() for side in sides)
    return ContactSolution(status, tuple(reached), message, memory, tuple(steps), loads(reached[-1].time))


def _at_rest(body: Body) -> Instant:
    nothing = np.zeros_like(body.mesh.nodes)
    return Instant(1.0, nothing, nothing, 0, 0, 0.0)


def _missing(body: Body, loads: Loads, at: ContactInstant) -> NDArray[np.float64]:
    """Contact forces of an instant [N], shape (N, 3): what loads and reactions leave to balance."""
    internal = body.at(at.displacement, stiffness=False).forces.reshape(-1, 3)
    return np.asarray(
        internal - at.reactions - external_forces(body, loads, at.displacement.reshape(-1)).reshape(-1, 3)
    )


def _first_omega(body: Body, sides: list[_Side]) -> float:
    """A cautious relaxation to begin with: the stiffer what is repelled, the more the skin overshoots; no obstacle."""
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


class _Turns:
    """Repelling and releasing at one time, in turns.

    Attributes:
        last: The last equilibrium of released bodies.
        forces: Contact forces on all nodes under which it is one [N], shape (N, 3).
        omega: Share of the forces found that bodies are released under, over those of the turn before; plainly all.
        solves: Static solves, two a turn.
        moves: Farthest move or overlap of any point in each turn [m].
        report: How it ended, in words.
        diverged: Whether turns did not settle, though each found its equilibria.
    """

    def __init__(
        self,
        body: Body,
        known: Prescribed,
        sides: list[_Side],
        loads: Loads,
        time: float,
        forces: NDArray[np.float64],
        omega: float | None,
        threshold: float,
    ) -> None:
        self._body, self._known, self._sides, self._loads, self._time = body, known, sides, loads, time
        self._aitken, self._threshold = omega is not None, threshold
        self._touches: list[Touch] = []
        self._iterations = 0
        self.forces, self.omega = forces, 1.0 if omega is None else omega
        self.solves = 0
        self.moves: list[float] = []
        self.report = ""
        self.diverged = False

    def through(self, last: Solution, first: NDArray[np.float64] | None, deepest: float) -> Status:
        """Turn until no point moves any more. Overlap beyond ``deepest`` [m] at the start is left to shorter steps."""
        rest, surface = self._body.mesh.nodes, _surface(self._sides)
        self.last = self._solve(self._known, self._loaded(self.forces), last, first)
        if not self.last.converged:
            return self._ended(self.last.status, f"the bodies do not follow what is prescribed: {self.last.message}")
        before = np.zeros(0)
        for turn in range(_TURNS):
            u = self.last.displacement
            meetings = [side.meet(rest + u, rest + u, self._time) for side in self._sides]
            overlap = max(float(np.maximum(-m.distance, 0.0).max(initial=0.0)) for m in meetings)
            if turn == 0 and overlap > deepest:
                return self._ended(Status.STAGNATED, f"bodies overlap by {1e3 * overlap:.3g} mm at once")
            fixed, found = self._repelled(surface, meetings)
            if not fixed.converged:
                return self._ended(fixed.status, f"repelled bodies found no equilibrium: {fixed.message}")
            off = (found - self.forces).ravel()
            if self._aitken and len(before) and (off != before).any():
                change = off - before
                wanted = -self.omega * float(before @ change) / float(change @ change)
                self.omega = float(np.clip(wanted, _LEAST * self.omega, min(_MOST * self.omega, 1.0)))
            before = off
            forces = self.forces + self.omega * off.reshape(-1, 3)
            # from where they were repelled to, if under nearly those forces: that is in equilibrium already
            start = fixed if self.omega > 0.5 else self.last
            freed = self._solve(self._known, self._loaded(forces), start)
            if not freed.converged:
                return self._ended(freed.status, f"released bodies give way under the forces found: {freed.message}")
            self.last, self.forces = freed, forces
            self.solves += 2
            moved = float(np.abs(freed.displacement - u).max())
            # what is relaxed moves less than it has yet to go
            self.moves.append(max(moved, self._way(fixed, u)))
            if self.moves[-1] < self._threshold:
                return self._ended(Status.CONVERGED, f"{turn + 1} turns")
            if self.moves[-1] > _RUNAWAY * min(self.moves):
                break
        self.diverged = True
        grows = self.growth
        how = f"each turn moves {grows:.2f} times as far as the one before"
        status = Status.STAGNATED if grows >= 1.0 else Status.MAX_ITERATIONS
        return self._ended(status, f"repelling and releasing did not settle in {len(self.moves)} turns: {how}")

    def _way(self, fixed: Solution, u: NDArray[np.float64]) -> float:
        """How far nodes that stay pushed were repelled [m]."""
        pushed = np.concatenate([side.slave.nodes[side.touching] for side in self._sides])
        return float(np.abs(fixed.displacement[pushed] - u[pushed]).max(initial=0.0))

    def _loaded(self, forces: NDArray[np.float64]) -> Loads:
        nodal = forces if self._loads.nodal is None else self._loads.nodal + forces
        return replace(self._loads, nodal=nodal)

    @property
    def growth(self) -> float:
        """Of the moves from turn to turn, as their geometric mean over the last ten; below 1 it settles."""
        moves = self.moves[-11:]
        return float((moves[-1] / moves[0]) ** (1.0 / (len(moves) - 1))) if len(moves) > 1 else np.nan

    def instant(self) -> ContactInstant:
        """What was reached."""
        found = self.last.last
        touches = tuple(self._touches)
        return ContactInstant(
            self._time, found.displacement, found.reactions, touches, self.solves, self._iterations, found.residual
        )

    def _repelled(self, surface: NDArray[np.int64], meetings: list[_Meeting]) -> tuple[Solution, NDArray[np.float64]]:
        """Steps 2 to 4: bodies with the skin held and slave nodes on it, and the forces of that on all nodes [N]."""
        rest, u = self._body.mesh.nodes, self.last.displacement
        repelled = _without(_repelled(rest, surface, u[surface], self._sides, meetings), self._known)
        fixed = self._solve(self._known + repelled, self._loads, self.last)
        forces = np.zeros_like(rest)
        self._touches = []
        for side, meeting in zip(self._sides, meetings, strict=True):
            own = side.share(meeting, fixed.reactions[side.slave.nodes[meeting.rows]], forces)
            self._touches.append(_touch(side, meeting, own, rest + fixed.displacement, len(rest)))
        return fixed, forces

    def _solve(
        self, known: Prescribed, loads: Loads, after: Solution, guess: NDArray[np.float64] | None = None
    ) -> Solution:
        found = solve(self._body, known, loads, after=after, guess=guess, free="hold", check=False)
        self._iterations += found.last.iterations
        return found

    def _ended(self, status: Status, report: str) -> Status:
        self.report = report
        return status


def _surface(sides: list[_Side]) -> NDArray[np.int64]:
    """Nodes of all masters."""
    return np.unique(np.concatenate([side.nodes for side in sides])).astype(np.int64)


def _repelled(
    rest: NDArray[np.float64],
    surface: NDArray[np.int64],
    skin: NDArray[np.float64],
    sides: list[_Side],
    meetings: list[_Meeting],
) -> Prescribed:
    """The skin where it is, and slave nodes on its polygons; a node that is both is skin."""
    nodes = [surface]
    places = [skin]
    for side, meeting in zip(sides, meetings, strict=True):
        nodes.append(side.slave.nodes[meeting.rows].astype(np.int64))
        places.append(meeting.target - rest[nodes[-1]])
    found, first = np.unique(np.concatenate(nodes), return_index=True)
    values = np.concatenate(places)[first]
    return Prescribed((3 * found[:, None] + np.arange(3)).ravel(), values.ravel())


def _without(given: Prescribed, known: Prescribed) -> Prescribed:
    keep = ~np.isin(given.degrees, known.degrees)
    return Prescribed(given.degrees[keep], given.values[keep])


def _touch(side: _Side, meeting: _Meeting, forces: NDArray[np.float64], x: NDArray[np.float64], count: int) -> Touch:
    from scipy.sparse import csr_array

    surface = side.slave
    nodes = surface.nodes[meeting.rows]
    area = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))[meeting.rows]
    traction = forces / area[:, None]
    pressure = np.einsum("mi,mi->m", traction, meeting.normal)
    nodal = np.zeros((count, 3))
    nodal[nodes] = forces
    there = csr_array((len(nodes), count))
    if meeting.place is not None:
        corners = side.nodes[side.triangles[meeting.place.face]]
        np.add.at(nodal, corners, -meeting.place.weights[:, :, None] * forces[:, None, :])
        rows = 3 * np.arange(len(nodes) + 1)
        there = csr_array((meeting.place.weights.ravel(), corners.ravel(), rows), shape=there.shape)
    pressed, still = np.where(pressure > 0.0, area, 0.0), np.zeros((len(nodes), 3))
    return Touch(
        side.pair.label,
        nodes,
        x[nodes],
        -meeting.normal,
        pressure,
        traction,
        meeting.distance,
        area,
        pressed,
        pressed,
        still,
        pressure > 0.0,
        np.zeros(len(nodes), dtype=bool),
        nodal,
        imprint_of(nodes, pressed * pressure, pressed, pressed, still, there, count),
    )
