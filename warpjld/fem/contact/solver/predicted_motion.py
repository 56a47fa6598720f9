"""Predicted motion of bodies in a load step without contact, extrapolated from prescribed nodes."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Ints
from warpjld.fem.body import Body
from warpjld.fem.load.prescribed import Prescribed, components, free_motions

__all__ = ["PredictedMotion"]


class PredictedMotion:
    """Extrapolation of prescribed displacements: free nodes move like the nearest prescribed node of their body.

    Args:
        body: All bodies, merged.
    """

    def __init__(self, body: Body) -> None:
        self._nodes = body.mesh.nodes
        self._piece = components(body)
        self._body = body
        self._free: tuple[bytes, bool] | None = None
        self._nearest: tuple[bytes, list[tuple[Ints, Ints]]] | None = None

    def leaves_free(self, prescribed: Prescribed) -> bool:
        """Whether the Dirichlet conditions leave a body free to move rigidly."""
        key = prescribed.degrees.tobytes()
        if self._free is None or self._free[0] != key:
            self._free = (key, bool(free_motions(self._body, prescribed)))
        return self._free[1]

    def displacement(self, u: Array, prescribed: Prescribed) -> Array:
        """Predicted displacement (3N,) from displacement u (3N,); bodies without Dirichlet conditions do not move."""
        out = u.reshape(-1, 3).copy()
        change = np.zeros(u.size)
        change[prescribed.degrees] = prescribed.values - u[prescribed.degrees]
        step = change.reshape(-1, 3)
        for axis, (to, nearest) in enumerate(self._table(prescribed)):
            out[to, axis] += step[nearest, axis]
        return out.reshape(-1)

    def _table(self, prescribed: Prescribed) -> list[tuple[Ints, Ints]]:
        """For each axis: nodes, and the prescribed node that each follows."""
        from scipy.spatial import cKDTree

        key = prescribed.degrees.tobytes()
        if self._nearest is None or self._nearest[0] != key:
            table: list[tuple[Ints, Ints]] = []
            for axis in range(3):
                given = prescribed.degrees[prescribed.degrees % 3 == axis] // 3
                to: list[Ints] = []
                nearest: list[Ints] = []
                for number in np.unique(self._piece[given]):
                    mine, known = np.flatnonzero(self._piece == number), given[self._piece[given] == number]
                    to.append(mine)
                    nearest.append(known[cKDTree(self._nodes[known]).query(self._nodes[mine])[1]])
                empty: list[Ints] = [np.empty(0, np.int64)]
                table.append((np.concatenate(to or empty), np.concatenate(nearest or empty)))
            self._nearest = (key, table)
        return self._nearest[1]
