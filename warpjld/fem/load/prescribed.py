"""Dirichlet conditions, the partition they define, and free rigid motions (B eqs. 6–8, R107, R110, R128)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import qr
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.body import Body
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = [
    "FreeBodyError",
    "Prescribed",
    "components",
    "free_motions",
    "held_in_place",
    "prescribe",
    "refuse_free",
    "rigid_modes",
]

_MOTIONS = (
    "translation along x",
    "translation along y",
    "translation along z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)


class FreeBodyError(InputError):
    """A body can move without deforming: a static problem would be singular."""


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Known displacements U_k by degree of freedom: one, two or three per node.

    Attributes:
        degrees: Degrees of freedom, 3 × node + axis, ascending, shape (n,).
        values: Their displacements [m], shape (n,).
    """

    degrees: Ints
    values: Array

    def __add__(self, other: Prescribed) -> Prescribed:
        both = np.concatenate([self.degrees, other.degrees])
        values = np.concatenate([self.values, other.values])
        order = np.argsort(both, kind="stable")
        both, values = both[order], values[order]
        first = np.ones(len(both), dtype=bool)
        first[1:] = both[1:] != both[:-1]
        group = np.cumsum(first) - 1
        kept = values[first]
        differ = np.abs(values - kept[group]) > 1e-12 * (1.0 + np.abs(values))
        if differ.any():
            k = int(np.argmax(differ))
            raise InputError(
                f"prescribed: node {both[k] // 3} is given two displacements along {'xyz'[both[k] % 3]}: "
                f"{kept[group[k]]:g} and {values[k]:g} m"
            )
        return Prescribed(both[first], kept)

    def scaled(self, factor: float) -> Prescribed:
        """The same degrees of freedom with displacements times ``factor``, for a load increment (R99)."""
        return Prescribed(self.degrees, factor * self.values)

    def free(self, count: int) -> Mask:
        """Mask of free degrees of freedom, shape (count,)."""
        mask = np.ones(count, dtype=bool)
        mask[self.degrees] = False
        return mask

    def full(self, count: int) -> Array:
        """A displacement vector that contains U_k, and zeros elsewhere, shape (count,)."""
        out = np.zeros(count)
        out[self.degrees] = self.values
        return out


def prescribe(
    mesh: HexMesh,
    where: str | ArrayLike,
    *,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    displacement: ArrayLike | None = None,
) -> Prescribed:
    """Prescribe some or all components of the displacement of nodes.

    Args:
        mesh: The mesh.
        where: Name of a node set, face set or region, or node numbers.
        x: Displacement along x [m], or None to leave it free; ``y``, ``z`` alike.
        displacement: All three components [m], shape (3,) or one row per node, shape (n, 3); NaN leaves one free.

    Raises:
        InputError: Unknown set, node out of range, or nothing prescribed.
    """
    nodes = mesh.node_set(where) if isinstance(where, str) else np.atleast_1d(np.asarray(where, dtype=np.int64))
    if len(nodes) and (nodes.min() < 0 or nodes.max() >= len(mesh.nodes)):
        raise InputError(f"prescribed: nodes must lie in 0…{len(mesh.nodes) - 1}, got {nodes.min()}…{nodes.max()}")
    if displacement is not None:
        given = np.broadcast_to(np.asarray(displacement, dtype=np.float64), (len(nodes), 3))
    else:
        row = np.array([np.nan if v is None else float(v) for v in (x, y, z)])
        given = np.broadcast_to(row, (len(nodes), 3))
    if np.isinf(given).any():
        raise InputError("prescribed: displacements must be finite")
    chosen = ~np.isnan(given)
    if not chosen.any():
        raise InputError("prescribed: want at least one of x, y, z")
    degrees = (3 * np.asarray(nodes, dtype=np.int64)[:, None] + np.arange(3))[chosen]
    order = np.argsort(degrees, kind="stable")
    return Prescribed(degrees[order], given[chosen][order]) + Prescribed(np.empty(0, np.int64), np.empty(0))


def components(body: Body) -> Ints32:
    """Connected component of each node, shape (N,)."""
    p = body.pattern
    n = len(p.rows) - 1
    graph = csr_array((np.ones(len(p.columns), np.int8), p.columns, p.rows), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int32)


def free_motions(body: Body, prescribed: Prescribed) -> list[tuple[Ints, Array]]:
    """Components with free rigid motions: nodes, and a basis (6, k) of the free motions, for each."""
    piece = components(body)
    found = []
    held_piece = piece[prescribed.degrees // 3]
    for number in range(int(piece.max()) + 1):
        nodes = np.flatnonzero(piece == number)
        mine = prescribed.degrees[held_piece == number]
        modes = rigid_modes(body.mesh.nodes[nodes])
        if len(mine):
            place = np.searchsorted(nodes, mine // 3)
            held = modes.reshape(-1, 3, 6)[place, mine % 3]
            _, sizes, right = np.linalg.svd(np.linalg.qr(np.pad(held, ((0, 6), (0, 0))), mode="r"))
            rank = int((sizes > 1e-6 * max(1.0, np.sqrt(len(mine)))).sum())
            left = right[rank:].T
        else:
            left = np.eye(6)
        if left.shape[1]:
            found.append((nodes, left))
    return found


def rigid_modes(nodes: Array) -> Array:
    """The six rigid motions of points, rotations about their centre scaled to unit displacement, shape (3n, 6)."""
    centred = nodes - nodes.mean(axis=0)
    reach = float(np.abs(centred).max()) or 1.0
    x, y, z = (centred / reach).T
    modes = np.zeros((len(nodes), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    modes[:, 1, 3], modes[:, 2, 3] = -z, y
    modes[:, 0, 4], modes[:, 2, 4] = z, -x
    modes[:, 0, 5], modes[:, 1, 5] = -y, x
    return modes.reshape(-1, 6)


def refuse_free(body: Body, prescribed: Prescribed) -> None:
    """Reject bodies with free rigid motions.

    Raises:
        FreeBodyError: Names the component, its regions and its free motions.
    """
    found = free_motions(body, prescribed)
    if not found:
        return
    nodes, left = found[0]
    inside = np.isin(body.mesh.elements[:, 0], nodes)
    regions = [body.mesh.region_names[r] for r in np.unique(body.mesh.regions[inside])]
    free = [_MOTIONS[k] for k in range(6) if np.abs(left[k]).max() > 0.3]
    raise FreeBodyError(
        f"the body of {len(nodes)} nodes ({', '.join(regions)}) is not constrained: free are {', '.join(free)}"
        + (f" (and {len(found) - 1} more bodies)" if len(found) > 1 else "")
        + ". Prescribe displacements, or hold free bodies with free='hold'"
    )


def held_in_place(body: Body, prescribed: Prescribed) -> Prescribed:
    """Constrain free rigid motions by the minimal number of degrees of freedom, at zero displacement.

    Degrees of freedom are chosen one by one such that each stops most of the remaining free motion (QR of the rigid
    motions with pivoting). Under loads in equilibrium their reactions are zero, and the choice changes the solution by
    a rigid motion only; otherwise their reactions show the imbalance.
    """
    for nodes, left in free_motions(body, prescribed):
        rows = rigid_modes(body.mesh.nodes[nodes]) @ left
        taken = prescribed.degrees[np.isin(prescribed.degrees // 3, nodes)]
        rows[3 * np.searchsorted(nodes, taken // 3) + taken % 3] = 0.0
        _, _, order = qr(rows.T, mode="economic", pivoting=True)
        chosen = np.sort(order[: left.shape[1]])
        degrees = 3 * nodes[chosen // 3] + chosen % 3
        prescribed = prescribed + Prescribed(degrees, np.zeros(len(degrees)))
    return prescribed
