"""What prescribed displacements leave to contact: bodies that nothing else holds, overlaps that it cannot part."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.solver.contact_system import ContactForces
from warpjld.fem.load.prescribed import Prescribed, free_motions
from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["UnconstrainedBodies", "blocked"]

_HELD = (3e-2, 0.4, 1e-4)
"""Stiffness given to bodies that only contact holds, over their own: it slows them down, and leaves no force. At first,
so that contact is found before they fly off; by which factor it then falls with each iteration; and the least.
"""
_FREE = 1e-9
"""Share of a point's weights that must be free to move along its normal for it to be parted."""


class UnconstrainedBodies:
    """The bodies that prescribed displacements do not hold.

    Args:
        body: All bodies, merged.
        prescribed: Known displacements.
        stiffness: Stiffness of each node [N/m], shape (N,).
    """

    def __init__(self, body: Body, prescribed: Prescribed, stiffness: Array) -> None:
        self._mesh = body.mesh
        self._stiff = stiffness
        self._bodies = [nodes for nodes, _ in free_motions(body, prescribed)]
        points = np.unique(prescribed.degrees // 3)
        self._held = [int(np.isin(points, nodes).sum()) for nodes in self._bodies]

    def __bool__(self) -> bool:
        return bool(self._bodies)

    def falling(self, contact: ContactForces) -> Mask:
        """Nodes of unconstrained bodies that nothing touches, shape (N,)."""
        out = np.zeros(len(self._mesh.nodes), dtype=bool)
        if self._bodies:
            touched = np.zeros(len(out), dtype=bool)
            for p, r in zip(contact.points, contact.tractions, strict=True):
                touched[p.weights[np.flatnonzero(r.active)].indices] = True
            for nodes in self._bodies:
                out[nodes] = not touched[nodes].any()
        return out

    def failure(self, interfaces: list[Interface], contact: ContactForces) -> tuple[SolveStatus, str]:
        """Why no equilibrium was found: such a body that nothing touches, or that slides wherever it is touched."""
        for nodes, held in zip(self._bodies, self._held, strict=True):
            mine = np.zeros(len(self._mesh.nodes), dtype=bool)
            mine[nodes] = True
            element = int(np.flatnonzero(mine[self._mesh.elements[:, 0]])[0])
            what = f"'{self._mesh.region_names[self._mesh.regions[element]]}'"
            touching = []
            for interface, p, r in zip(interfaces, contact.points, contact.tractions, strict=True):
                rows = np.flatnonzero(r.active)
                rows = rows[(p.weights[rows] @ mine.astype(float) != 0.0)] if len(rows) else rows
                if len(rows):
                    touching.append((interface.pair.title, bool(r.sticking[rows].any())))
            points = f"the {held} prescribed points" if held > 1 else "the one prescribed point"
            if not touching:
                return SolveStatus.UNHELD, f"{points} of {what} cannot hold it" if held else f"nothing holds {what}"
            if not any(sticks for _, sticks in touching):
                more = f", and {points} cannot" if held else ""
                return (
                    SolveStatus.SLIDING,
                    f"{what} slides at {touching[0][0]}: friction is not enough to hold it{more}",
                )
        return SolveStatus.MAX_ITERATIONS, ""

    def within(self, move: Array, reach: float) -> float:
        """Share of a move (3N,) by which unconstrained bodies go no farther than ``reach`` [m]."""
        far = max((float(np.abs(move.reshape(-1, 3)[nodes]).max()) for nodes in self._bodies), default=0.0)
        return min(1.0, reach / far) if far > 0.0 else 1.0

    def steadied(self, matrix: BlockMatrix, turn: int) -> BlockMatrix:
        """A matrix that holds unconstrained bodies back, less with every turn."""
        if not self._bodies:
            return matrix
        first, falls, least = _HELD
        nodes = np.sort(np.concatenate(self._bodies))
        added = max(least, first * falls**turn) * self._stiff[nodes]
        values = matrix.values.copy()
        values[matrix.on_diagonal[nodes]] += added[:, None, None] * np.eye(3)
        return BlockMatrix(matrix.rows, matrix.columns, values)


def blocked(
    interfaces: list[Interface],
    points: list[ContactPoints],
    states: list[ContactState],
    free: Mask,
    *,
    allowed: float,
    penetration: float,
) -> str:
    """The deepest overlap between sides that are both prescribed, in words; nothing where there is none.

    Args:
        interfaces: What may touch.
        points: Of each, where prescribed displacements are in place.
        states: Of each: overlap that is still allowed, and bonds.
        free: Degrees of freedom, shape (3N,).
        allowed: Share of the states' allowance that still counts.
        penetration: Overlap that may be left, as a share of an edge.
    """
    worst, words = 0.0, ""
    moves = free.reshape(-1, 3).astype(float)
    for interface, p, s in zip(interfaces, points, states, strict=True):
        if len(p.sites) == 0:
            continue
        mobile = np.einsum("mi,mi->m", abs(p.weights) @ moves, p.normal**2)
        depth = np.where(s.bonded[p.sites], 0.0, -p.gap - allowed * s.allowance[p.sites])
        depth = np.where(mobile < _FREE, depth, 0.0)
        deepest = int(np.argmax(depth))
        if depth[deepest] > max(penetration * interface.edge[p.sites[deepest]], worst):
            worst = float(depth[deepest])
            node = interface.slave.nodes[int(np.argmax(interface.share[[p.sites[deepest]]].toarray()))]
            words = f"{interface.pair.title}: both sides are prescribed and overlap by {worst:.3g} m at node {node}"
    return words
