"""Bodies held by contact alone (insufficient Dirichlet conditions), and overlaps that contact cannot remove."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.solver.contact_system import GRAZING, IMMOBILE, ContactForces
from warpjld.fem.load.prescribed import Prescribed, free_motions, rigid_modes
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.geometry.coincident import connected_parts

__all__ = ["UnconstrainedBodies", "blocked"]

_HELD = (3e-2, 0.4, 1e-4)
"""Artificial stiffness of bodies held by contact alone, relative to their own; it limits steps and causes no force.
First value (large enough to find contact), factor per iteration, and smallest value."""
_GRASPED = 1e-4
"""Smallest over largest eigenvalue of the contact stiffness on rigid motions above which contact resists all
motions."""


class UnconstrainedBodies:
    """Bodies whose Dirichlet conditions leave rigid motions free.

    Args:
        body: All bodies, merged.
        prescribed: Dirichlet conditions.
        stiffness: Stiffness of each node [N/m], shape (N,).
    """

    def __init__(self, body: Body, prescribed: Prescribed, stiffness: Array) -> None:
        self._mesh = body.mesh
        self._stiff = stiffness
        found = free_motions(body, prescribed)
        self._bodies = [nodes for nodes, _ in found]
        self._modes = [(nodes, rigid_modes(body.mesh.nodes[nodes]).reshape(-1, 3, 6) @ left) for nodes, left in found]
        points = np.unique(prescribed.degrees // 3)
        self._held = [int(np.isin(points, nodes).sum()) for nodes in self._bodies]

    def __bool__(self) -> bool:
        return bool(self._bodies)

    def falling(self, contact: ContactForces) -> Mask:
        """Mask of the nodes of unconstrained bodies that touch nothing but one another, shape (N,)."""
        out = np.zeros(len(self._mesh.nodes), dtype=bool)
        for group in self._adrift(contact):
            out[np.concatenate([self._bodies[k] for k in group])] = True
        return out

    def _adrift(self, contact: ContactForces) -> list[list[int]]:
        """Groups of unconstrained bodies that active contact, or bonds, connect to nothing but one another."""
        count = len(self._bodies)
        if not count:
            return []
        label = np.full(len(self._mesh.nodes), count)  # the last one stands for all that is held, and for obstacles
        for k, nodes in enumerate(self._bodies):
            label[nodes] = k
        links = []
        for p, r in zip(contact.points, contact.tractions, strict=True):
            rows = np.flatnonzero(r.active)
            if not len(rows):
                continue
            touched = p.weights[rows].tocoo()
            row, column = touched.coords
            met = np.zeros((len(rows), count + 1), dtype=bool)
            met[row[touched.data != 0.0], label[column[touched.data != 0.0]]] = True
            met[np.asarray(touched.sum(axis=1)).ravel() > 0.5, count] = True  # between meshes weights sum to 0
            first = met.argmax(axis=1)
            links += [(int(one), k) for k in range(count + 1) for one in np.unique(first[met[:, k]])]
        part = connected_parts(np.array(links, np.int64).reshape(-1, 2), count + 1)
        alone = [k for k in range(count) if part[k] != part[count]]
        return [[k for k in alone if part[k] == one] for one in dict.fromkeys(int(part[k]) for k in alone)]

    def _name(self, body: int) -> str:
        """Name of an unconstrained body's first region, in quotes."""
        mine = np.zeros(len(self._mesh.nodes), dtype=bool)
        mine[self._bodies[body]] = True
        element = int(np.flatnonzero(mine[self._mesh.elements[:, 0]])[0])
        return f"'{self._mesh.region_names[self._mesh.regions[element]]}'"

    def failure(self, interfaces: list[Interface], contact: ContactForces) -> tuple[SolveStatus, str]:
        """Reason for a failure: an unconstrained body without contact, or one that slides at all its contacts."""
        for group in self._adrift(contact):
            if len(group) > 1 and not any(self._held[k] for k in group):
                return SolveStatus.UNHELD, f"nothing holds {' and '.join(self._name(k) for k in group)}"
        for k, (nodes, held) in enumerate(zip(self._bodies, self._held, strict=True)):
            mine = np.zeros(len(self._mesh.nodes), dtype=bool)
            mine[nodes] = True
            what, touching = self._name(k), []
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
        """Fraction of a move (3N,) in which no node of an unconstrained body moves farther than ``reach`` [m]."""
        far = max((float(np.abs(move.reshape(-1, 3)[nodes]).max()) for nodes in self._bodies), default=0.0)
        return min(1.0, reach / far) if far > 0.0 else 1.0

    def grasped(self, contact: ContactForces) -> bool:
        """Whether contact resists all their rigid motions, so that no artificial stiffness is needed."""
        count = sum(modes.shape[2] for _, modes in self._modes)
        stiffness = np.zeros((count, count))
        for p, t in zip(contact.points, contact.tractions, strict=True):
            rows = np.flatnonzero(t.active)
            moved = []  # displacements of the points by each rigid mode of each body
            for nodes, modes in self._modes:
                there = p.weights[rows][:, nodes] @ modes.reshape(len(nodes), -1)
                moved.append(there.reshape(len(rows), 3, modes.shape[2]))
            moves = np.concatenate(moved, axis=2)
            stiffness += np.einsum("mik,mij,mjl->kl", moves, t.blocks[rows], moves)
        resisted = np.linalg.eigvalsh(stiffness)
        return bool(resisted[0] > _GRASPED * resisted[-1] > 0.0)

    def steadied(self, matrix: BlockMatrix, turn: int) -> BlockMatrix:
        """The matrix with the artificial stiffness of an iteration added at unconstrained bodies."""
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
) -> str:
    """Message about the deepest overlap between two prescribed sides; empty if there is none.

    Args:
        interfaces: Contact interfaces.
        points: Their contact points, with the Dirichlet values applied.
        states: Their states, with allowances and bonds.
        free: Mask of free degrees of freedom, shape (3N,).
        allowed: Fraction of the allowances that still counts.
    """
    worst, words = 0.0, ""
    for interface, p, s in zip(interfaces, points, states, strict=True):
        if len(p.sites) == 0:
            continue
        depth = np.where(s.bonded[p.sites], 0.0, -p.gap - allowed * s.allowance[p.sites])
        depth = np.where(p.mobility(free) < IMMOBILE, depth, 0.0)
        deepest = int(np.argmax(depth))
        if depth[deepest] > max(GRAZING * interface.edge[p.sites[deepest]], worst):
            worst = float(depth[deepest])
            words = f"{interface.pair.title}: both sides are prescribed and overlap by {1e3 * worst:.3g} mm"
    return words
