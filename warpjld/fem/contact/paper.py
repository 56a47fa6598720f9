"""The paper's loop: objects are repelled by the skin, then both are released under the forces found (B Fig. 9, R113).

1. The bones are prescribed. 2. Slave nodes that overlap are put onto the master's polygons, the master's surface is
held. 3. K11 U_u = R_k − K12 U_k and the reactions. 4. Each reaction goes, equal and opposite, to the three nodes of the
facet that repelled it, by barycentric weights. 5. The forces are taken as known, both bodies are released and solved
for. Steps 2–5 are repeated until no point moves any more.

It is a fixed point s → F(s) of the master's surface, whose slope is the slave's stiffness over the master's. So it
settles where the master is the stiffer of the two, and diverges where the slave is as stiff as the master or stiffer;
Aitken's relaxation of s settles both, in more iterations. Friction is not in it (R122): while repelled, nodes stick.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.body import Body
from warpjld.fem.conjugate import Status
from warpjld.fem.contact.facets import Facets, Place
from warpjld.fem.contact.obstacles import Obstacle
from warpjld.fem.contact.pairs import Pair
from warpjld.fem.contact.solution import ContactInstant, ContactSolution, Touch
from warpjld.fem.contact.surface import ContactSurface, surface_of
from warpjld.fem.loads import Loads
from warpjld.fem.prescribed import Prescribed
from warpjld.fem.solution import Solution
from warpjld.fem.static import solve

__all__ = ["by_turns"]

_TURNS = 60
_CAUTION = 0.25
"""First relaxation; it then changes by no more than a factor of two a turn."""
_DEEPEST = 5.0
"""Overlap, over an edge, beyond which a node is taken to have another side of the master behind it."""
_RUNAWAY = 1e3
"""Growth of the move from its least that is called divergence."""


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
    aitken: bool = False,
    threshold: float = 1e-3,
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
        aitken: Relax the master's surface after Aitken (Küttler & Wall 2008).
        threshold: Move of any point, over an edge, below which it has settled.
        watch: See ``press``.
        progress: See ``press``.
    """
    sides = [_Side(body, pair) for pair in pairs]
    edge = min(float(side.slave.edge.min()) for side in sides)
    reached: list[ContactInstant] = []
    steps: list[int] = []
    last: Solution | None = None
    status, message = Status.CONVERGED, Status.CONVERGED.value
    for time in times:
        status, last, instant = _instant(
            body, prescribed(time), sides, loads(time), time, last, aitken, threshold * edge
        )
        steps.append(instant.solves)
        reached.append(instant)
        if progress:
            progress(f"time {time:.3g}: {instant.solves // 2} turns, {status.value}")
        if status is not Status.CONVERGED:
            message = (
                f"at time {time:.4g}: repelling and releasing did not settle ({status.value}); it does where the "
                "master is the stiffer body, or with Aitken's relaxation, or use the default method"
            )
            break
        reason = watch(instant) if watch else None
        if reason:
            status, message = Status.STOPPED, reason
            break
    return ContactSolution(status, tuple(reached), message, (), tuple(steps), loads(reached[-1].time))


def _instant(
    body: Body,
    known: Prescribed,
    sides: list[_Side],
    loads: Loads,
    time: float,
    last: Solution | None,
    aitken: bool,
    threshold: float,
) -> tuple[Status, Solution, ContactInstant]:
    rest = body.mesh.nodes
    base = np.zeros_like(rest) if loads.nodal is None else loads.nodal
    if last is None:
        last = solve(body, known, loads, free="hold", check=False)
    else:
        last = solve(body, known, last.loads, after=last, free="hold", check=False)
    u = last.displacement
    surface = np.unique(np.concatenate([side.nodes for side in sides])).astype(np.int64)
    skin = u[surface]
    omega, before = _CAUTION if aitken else 1.0, np.zeros(0)
    least, iterations, solves = np.inf, last.last.iterations, 0
    status = Status.MAX_ITERATIONS
    touches: list[Touch] = []
    for _ in range(_TURNS):
        held = rest.copy()
        held[surface] += skin
        meetings = [side.meet(rest + u, held, time) for side in sides]
        repelled = _without(_repelled(rest, surface, skin, sides, meetings), known)
        fixed = solve(body, known + repelled, loads, after=last, free="hold", check=False)
        forces = np.zeros_like(rest)
        touches = []
        for side, meeting in zip(sides, meetings, strict=True):
            own = side.share(meeting, fixed.reactions[side.slave.nodes[meeting.rows]], forces)
            touches.append(_touch(side, meeting, own, rest + fixed.displacement, len(rest)))
        freed = solve(body, known, replace(loads, nodal=base + forces), after=last, free="hold", check=False)
        solves += 2
        iterations += fixed.last.iterations + freed.last.iterations
        if not (fixed.converged and freed.converged):
            status = (freed if fixed.converged else fixed).status
            break
        moved = float(np.abs(freed.displacement - u).max())
        u, last = freed.displacement, freed
        off = (u[surface] - skin).ravel()
        gone = float(np.abs(off).max(initial=0.0))
        if max(moved, gone) < threshold:
            status = Status.CONVERGED
            break
        least = min(least, max(moved, gone))
        if max(moved, gone) > _RUNAWAY * least:
            status = Status.STAGNATED
            break
        if aitken and len(before) and (off != before).any():
            change = off - before
            wanted = -omega * float(before @ change) / float(change @ change)
            omega = float(np.clip(wanted, 0.5 * omega, min(2.0 * omega, 1.5)))
        before = off
        skin = skin + omega * off.reshape(-1, 3)
    residual = last.last.residual
    instant = ContactInstant(time, u, last.reactions, tuple(touches), solves, iterations, residual)
    return status, last, instant


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
    surface = side.slave
    nodes = surface.nodes[meeting.rows]
    area = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))[meeting.rows]
    traction = forces / area[:, None]
    pressure = np.einsum("mi,mi->m", traction, meeting.normal)
    nodal = np.zeros((count, 3))
    nodal[nodes] = forces
    if meeting.place is not None:
        corners = side.nodes[side.triangles[meeting.place.face]]
        np.add.at(nodal, corners, -meeting.place.weights[:, :, None] * forces[:, None, :])
    return Touch(
        side.pair.label,
        nodes,
        x[nodes],
        -meeting.normal,
        pressure,
        traction,
        meeting.distance,
        area,
        np.where(pressure > 0.0, area, 0.0),
        np.zeros((len(nodes), 3)),
        pressure > 0.0,
        np.zeros(len(nodes), dtype=bool),
        nodal,
    )
