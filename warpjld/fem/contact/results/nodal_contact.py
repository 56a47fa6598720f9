"""Contact values on the nodes of both sides of a pair, slave and master alike (R95).

Normal forces at the slave's points are distributed to both sides' nodes by their shape functions; areas and slips are
transferred with the same weights. Sums over the nodes of either side therefore equal those of the pair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["NodalContact", "stacked", "to_nodes", "tributary_areas"]


@dataclass(frozen=True, eq=False)
class NodalContact:
    """Contact values of one pair on all nodes of the body, shape (N,), or of several pairs, shape (P, N).

    Attributes:
        force: Normal force [N].
        area: Contact area [m²] (``PairContact.pressed``).
        held: Part of it that sticks or is bonded [m²] (``PairContact.held``).
        slid: Integral over it of the slip distance [m³].
    """

    force: Array
    area: Array
    held: Array
    slid: Array

    def of(self, which: Any) -> NodalContact:
        """The same values, indexed by ``which``."""
        return NodalContact(*(getattr(self, one.name)[which] for one in fields(self)))


def to_nodes(
    slave: Ints32, push: Array, pressed: Array, held: Array, slip: Array, there: Any, count: int
) -> NodalContact:
    """Distribute contact values at slave nodes to the nodes of both sides.

    Args:
        slave: Slave nodes, shape (n,).
        push: Normal forces on them [N], shape (n,).
        pressed: Their contact areas [m²], shape (n,).
        held: Parts of these that stick or are bonded [m²], shape (n,).
        slip: Relative tangential displacements [m], shape (n, 3).
        there: Weights of the master's nodes for each slave node, rows sum to one, or empty; sparse (n, N).
        count: Number of nodes of the body, N.
    """
    slid = pressed * np.linalg.norm(slip, axis=1)
    both = []
    for values in (push, pressed, held, slid):
        out = np.asarray(there.T @ values, dtype=np.float64)
        out[slave] += values
        both.append(out)
    assert all(out.shape == (count,) for out in both)
    return NodalContact(*both)


def stacked(nodal_contacts: Sequence[NodalContact], count: int) -> NodalContact:
    """Contact values of P pairs as arrays of shape (P, N)."""
    empty = np.zeros((0, count))
    return NodalContact(
        *(
            np.stack([getattr(i, f.name) for i in nodal_contacts]) if nodal_contacts else empty
            for f in fields(NodalContact)
        )
    )


def tributary_areas(mesh: HexMesh, faces: Ints32 | str, x: Array) -> Array:
    """Tributary areas: a quarter of the faces around every node at positions x (N, 3) [m²], 0 elsewhere, shape (N,).

    The pressure of tables and pictures is the normal force on a node over its tributary area.
    """
    quads = mesh.quads(mesh.face_set(faces) if isinstance(faces, str) else faces)
    corner = x[quads]
    area = 0.125 * np.linalg.norm(np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]), axis=1)
    return np.asarray(np.bincount(quads.ravel(), np.repeat(area, 4), len(x)), np.float64)
