"""Detection of penetration that the contact discretisation misses because the mesh is too coarse.

Gaps between two meshes are averages over the faces around a node: contact of a corner with a face is detected only once
it has penetrated by a fraction of an edge. Contact with obstacles is evaluated at nodes: an edge of an obstacle that
passes between nodes is not detected. The equilibrium equations do not show such penetration, so it is measured here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.results.contact_solution import ContactInstant
from warpjld.fem.contact.solver.facet_ridges import scatter_by_ridges
from warpjld.fem.contact.solver.passing import Passing

__all__ = ["unresolved"]

_UNPRESSED, _BESIDE = 0.05, 0.15
"""Accepted penetration of a node without contact force, in edge lengths: in pairs without any contact, and in pairs
with contact (non-matching faces penetrate beside the contact area by a tenth of an edge)."""
_PRESSED = 0.25
"""The same for nodes that press. Between smooth bodies they penetrate by a twentieth of an edge at most; a corner
between the nodes of the other side that penetrated by 0.3 edges pressed 28 % too little, by 0.5 edges 70 %."""
_RIDGED = 0.25
"""Error of single pressures over its peak value from which facets are reported."""
_IN_FACE = 0.1
"""Accepted penetration of an obstacle into a face between its nodes, in edge lengths."""
_SAMPLES = 4
"""Sample points of a face along each of its edges."""


def unresolved(
    rest: Array,
    interfaces: Sequence[Interface],
    moduli: Sequence[Array],
    passing: Passing,
    instant: ContactInstant,
    allowed: float,
) -> list[str]:
    """Warnings about what an instant's contact does not resolve: penetration of the deepest node and of obstacles, and
    pressures on ridges between facets.

    Args:
        rest: Positions of the bodies' nodes [m], shape (N, 3).
        interfaces: Contact interfaces.
        moduli: Contact modulus E* at each interface's slave nodes [Pa].
        passing: Penetration check of the same interfaces.
        instant: The instant.
        allowed: Remaining share of the initial overlap; no warnings while it is greater than 0.
    """
    if allowed > 0.0 or not instant.touches:
        return []
    x, out = rest + instant.displacement, []
    touched = [np.flatnonzero(touch.nodal.any(axis=1)) for touch in instant.touches]
    slack = np.array([_BESIDE if len(nodes) else _UNPRESSED for nodes in touched])
    u, nothing = instant.displacement.reshape(-1), [np.empty(0, np.int64)] * len(interfaces)
    depth, k = passing.deepest(u, instant.time, touched, slack)
    if depth > 0.0:
        out.append(
            f"{interfaces[k].pair.title}: a corner or an edge lies {1e3 * depth:.3g} mm inside the other side without "
            "contact: forces are too low; use smaller elements"
        )
    else:
        # flesh has no corners that press on itself, and folds at its joints
        depth, k = passing.deepest(u, instant.time, nothing, np.full(len(interfaces), _PRESSED), own=False)
        if depth > 0.0:
            out.append(
                f"{interfaces[k].pair.title}: a corner or an edge that presses lies {1e3 * depth:.3g} mm inside the "
                "other side: forces are too low, by half and more; use smaller elements"
            )
    for interface, modulus, touch in zip(interfaces, moduli, instant.touches, strict=True):
        scatter = scatter_by_ridges(interface, modulus, touch, x)
        if scatter > _RIDGED:
            out.append(
                f"{interface.pair.title}: the master's facets are larger than the slave's and turn so much from one to "
                f"the next that pressures scatter by up to {100.0 * scatter:.0f} %; use smaller elements there"
            )
    for interface in interfaces:
        if isinstance(interface.pair.master, Obstacle) and interface.pair.sites == "nodes":
            depth = _between_nodes(interface, interface.pair.master, x, instant.time)
            if depth > 0.0:
                out.append(
                    f"{interface.pair.title}: the obstacle enters a face by {1e3 * depth:.3g} mm between its nodes: "
                    'forces are too low; use smaller elements (in Python, or sites="faces")'
                )
    return out


def _between_nodes(interface: Interface, obstacle: Obstacle, x: Array, time: float) -> float:
    """Greatest penetration of an obstacle into a face between its nodes [m]; 0 if below the accepted one.

    Args:
        interface: Interface with the obstacle.
        obstacle: The obstacle.
        x: Positions of the body's nodes [m], shape (N, 3).
        time: Time at which the obstacle's position is evaluated.
    """
    surface, offset = interface.slave, interface.pair.offset
    edge = surface.edge[surface.corners].mean(axis=1)
    near = obstacle.project(x[surface.nodes], time).distance[surface.corners].min(axis=1) < edge
    faces = np.flatnonzero(near)
    line = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    r, t = (v.ravel() for v in np.meshgrid(line, line))
    shape = np.stack([(1.0 - r) * (1.0 - t), r * (1.0 - t), r * t, (1.0 - r) * t], axis=1)
    quads = surface.quads[faces]
    at = np.einsum("qk,fki->fqi", shape, x[quads])
    depth = -obstacle.project(at.reshape(-1, 3), time).distance.reshape(at.shape[:2])
    if offset is not None:
        depth += offset[quads] @ shape.T
    return float(depth[depth > _IN_FACE * edge[faces, None]].max(initial=0.0))
