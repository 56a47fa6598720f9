"""Contact that is finer than the faces that are to see it: a corner or an edge that presses hardly, or not at all.

Between two meshes gaps are averages over the faces around a node: a corner that meets a face is seen when it stands
in it by a share of an edge. Obstacles are met by nodes: an edge of theirs that passes between nodes is not seen. No
equation says so; distances do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.results.contact_solution import ContactInstant
from warpjld.fem.contact.solver.passing import Passing

__all__ = ["unresolved"]

_UNPRESSED, _BESIDE = 0.05, 0.15
"""Edges by which a node may stand in another body unpressed: where nothing of a pair presses, and where something does:
faces that do not match stand in one another beside contact by a tenth of an edge."""
_IN_FACE = 0.1
"""Edges by which an obstacle may stand in a face between its nodes."""
_SAMPLES = 4
"""Places at which a face is looked at, along each of its edges."""


def unresolved(
    rest: Array, interfaces: Sequence[Interface], passing: Passing, instant: ContactInstant, allowed: float
) -> list[str]:
    """What an instant's contact does not see, in words, one for each pair at most.

    Args:
        rest: Positions of the bodies' nodes [m], shape (N, 3).
        interfaces: What may touch.
        passing: Of these.
        instant: The instant.
        allowed: Share of an overlap at the start that is left: nothing is said of one that is still parted.
    """
    if allowed > 0.0 or not instant.touches:
        return []
    x, out = rest + instant.displacement, []
    touched = [np.flatnonzero(touch.nodal.any(axis=1)) for touch in instant.touches]
    slack = np.array([_BESIDE if len(some) else _UNPRESSED for some in touched])
    depth, k = passing.deepest(instant.displacement.reshape(-1), instant.time, touched, slack)
    if depth > 0.0:
        out.append(
            f"{interfaces[k].pair.title}: a corner or an edge lies {1e3 * depth:.3g} mm inside the other side without "
            "contact: forces are too low; use smaller elements"
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
    """How deep an obstacle stands in a face between its nodes [m]; 0 where it hardly does.

    Args:
        interface: A pair with an obstacle.
        obstacle: It.
        x: Positions of the body's nodes [m], shape (N, 3).
        time: Of the obstacle.
    """
    surface, offset = interface.slave, interface.pair.offset
    edge = surface.edge[surface.corners].mean(axis=1)
    near = obstacle.project(x[surface.nodes], time).distance[surface.corners].min(axis=1) < edge
    some = np.flatnonzero(near)
    line = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    r, t = (v.ravel() for v in np.meshgrid(line, line))
    shape = np.stack([(1.0 - r) * (1.0 - t), r * (1.0 - t), r * t, (1.0 - r) * t], axis=1)
    quads = surface.quads[some]
    at = np.einsum("qk,fki->fqi", shape, x[quads])
    depth = -obstacle.project(at.reshape(-1, 3), time).distance.reshape(at.shape[:2])
    if offset is not None:
        depth += offset[quads] @ shape.T
    return float(depth[depth > _IN_FACE * edge[some, None]].max(initial=0.0))
