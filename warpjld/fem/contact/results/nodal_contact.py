"""Contact on the nodes of both sides of a pair, whichever of them carries the multipliers (R95).

A slave's points press on its own nodes with shape functions, and on the other side's with those there; areas and slips
are handed over with the same weights. Sums over the nodes of either side are therefore the pair's own.
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
    """Of one pair on all nodes of the body, shape (N,), or of several, shape (P, N).

    Attributes:
        force: That presses [N].
        area: Under pressure, inside a border that runs between nodes [m²] (``Touch.pressed``).
        held: The part of it that friction or a bond holds [m²] (``Touch.held``).
        slid: Integral over it of the way along the other side since the instant before [m³].
    """

    force: Array
    area: Array
    held: Array
    slid: Array

    def of(self, which: Any) -> NodalContact:
        """A part of it, by an index into its arrays."""
        return NodalContact(*(getattr(self, one.name)[which] for one in fields(self)))


def to_nodes(
    slave: Ints32, push: Array, pressed: Array, held: Array, slip: Array, there: Any, count: int
) -> NodalContact:
    """Hand what slave nodes (n) know to all nodes.

    Args:
        slave: The nodes, shape (n,).
        push: What presses on them [N], shape (n,).
        pressed: Their area under pressure [m²], shape (n,).
        held: What of it friction or a bond holds [m²], shape (n,).
        slip: Relative displacement since the instant before [m], shape (n, 3).
        there: Weights of the other side's nodes for each of them, rows summing to one, or empty, sparse (n, N).
        count: Nodes of the body, N.
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
    """Those of P pairs, shape (P, N)."""
    nothing = np.zeros((0, count))
    return NodalContact(
        *(
            np.stack([getattr(i, f.name) for i in nodal_contacts]) if nodal_contacts else nothing
            for f in fields(NodalContact)
        )
    )


def tributary_areas(mesh: HexMesh, faces: Ints32 | str, x: Array) -> Array:
    """A quarter of the area of all faces around every node at positions x (N, 3) [m²], 0 elsewhere, shape (N,).

    What presses on a node over it is the pressure there that tables and pictures show.
    """
    quads = mesh.quads(mesh.face_set(faces) if isinstance(faces, str) else faces)
    corner = x[quads]
    area = 0.125 * np.linalg.norm(np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]), axis=1)
    return np.asarray(np.bincount(quads.ravel(), np.repeat(area, 4), len(x)), np.float64)
