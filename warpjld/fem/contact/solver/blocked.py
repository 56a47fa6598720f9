"""Overlaps that nothing can part: all that meets there is prescribed."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Mask
from warpjld.fem.contact.interface.contact_points import ContactPoints, Interface
from warpjld.fem.contact.law.law import ContactState

__all__ = ["blocked"]

_FREE = 1e-9
"""Share of a point's weights that must be free to move along its normal for it to be parted."""


def blocked(
    interfaces: list[Interface],
    points: list[ContactPoints],
    memory: list[ContactState],
    free: Mask,
    *,
    allowed: float,
    penetration: float,
) -> str:
    """The deepest overlap between sides that are both prescribed, in words; nothing where there is none.

    Args:
        interfaces: What may touch.
        points: Of each, where prescribed displacements are in place.
        memory: Of each: overlap that is still allowed, and bonds.
        free: Degrees of freedom, shape (3N,).
        allowed: Share of the memory's allowance that still counts.
        penetration: Overlap that may be left, as a share of an edge.
    """
    worst, words = 0.0, ""
    moves = free.reshape(-1, 3).astype(float)
    for interface, p, m in zip(interfaces, points, memory, strict=True):
        if len(p.sites) == 0:
            continue
        mobile = np.einsum("mi,mi->m", abs(p.weights) @ moves, p.normal**2)
        depth = np.where(m.bonded[p.sites], 0.0, -p.gap - allowed * m.allowance[p.sites])
        depth = np.where(mobile < _FREE, depth, 0.0)
        deepest = int(np.argmax(depth))
        if depth[deepest] > max(penetration * interface.edge[p.sites[deepest]], worst):
            worst = float(depth[deepest])
            node = interface.slave.nodes[int(np.argmax(interface.share[[p.sites[deepest]]].toarray()))]
            words = f"{interface.pair.title}: both sides are prescribed and overlap by {worst:.3g} m at node {node}"
    return words
