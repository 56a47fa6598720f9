"""Filter of facet pairs: false overlaps, of facets that face each other through a thin body.

Of two fingers side by side the back of one faces the palmar side of the other, as surfaces do that overlap, only a
whole finger deep. Where their sides touch, slivers of such facets lie one before the other, and one finger would be
pushed out through the other. In the bottom of a crease normals of nodes are far from those of the facets around, and
what is opposite a facet seems to be behind its node. The far side of a fingertip no larger than a few facets faces
what the near side touches. What really overlaps so deep is that deep inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.contact.interface.surface import ContactSurface
from warpjld.fem.launch import on_rows, shared
from warpjld.geometry.rotations import unit

if TYPE_CHECKING:
    from warpjld.fem.contact.interface.mortar import Mortar

__all__ = ["counted_share"]

_TIMES, _SLACK = 3.0, 0.5
"""Overlap along the normal that counts for nothing: over how deep facets are inside each other, and that of facets that
only touch, in edges. Half of it counts fully."""
_OWN_SLACK = 1.0
"""The latter for parts that belong together, whose depth in each other is not known: they are inside one another where
they are joined."""


def counted_share(mortar: Mortar, pairs: Ints32, integrals: Array, normals: Array, x: Array, reach: float) -> Array:
    """Share of pairs (P, 2) of facets that counts, 0 where they only seem to overlap, shape (P,).

    Args:
        mortar: The two surfaces.
        pairs: Facets face to face.
        integrals: Of each, as the mortar kernel has them, shape (P, 33).
        normals: At the slave's nodes, shape (m, 3).
        x: Positions of the body's nodes [m], shape (N, 3).
        reach: Farthest that facets look at each other [m].
    """
    slave, master = mortar.slave, mortar.master
    mine, others = mortar.labels
    joined = mortar.joined[mine[pairs[:, 0]], others[pairs[:, 1]]] > 0
    out = np.ones(len(pairs))
    if mortar.fringe is not None:
        out[joined] = mortar.fringe[pairs[joined]].min(axis=1)
    own = integrals[:, :16].reshape(-1, 4, 4).sum(axis=1)
    far = integrals[:, 16:32].reshape(-1, 4, 4).sum(axis=1)
    area = own.sum(axis=1, keepdims=True)
    own, far = own / area, far / area
    corners = slave.corners[pairs[:, 0]]
    facing = unit(slave.area_vectors(x)[pairs[:, 0]])[:, None]
    facing = np.concatenate([facing, normals[corners]], axis=1)
    between = np.einsum("pk,pki->pi", far, x[master.quads[pairs[:, 1]]])
    between -= np.einsum("pk,pki->pi", own, x[slave.quads[pairs[:, 0]]])
    overlap = -np.einsum("pki,pi->pk", facing, between).min(axis=1)
    slack = np.where(joined, _OWN_SLACK, _SLACK) * slave.edge[corners].mean(axis=1)
    some = np.flatnonzero(overlap > 0.5 * slack)
    if not len(some):
        return out
    inside = np.zeros(len(some))
    sides: list[_Side] = [(slave, mine), (master, others)]
    for side, shares in enumerate((own, far)):
        asked, rows = np.unique(pairs[some, side], return_inverse=True)
        depth = _depths(asked, sides[side], sides[1 - side], mortar.joined, x, reach, mortar.threads)[rows]
        inside = np.maximum(inside, (shares[some] * depth).sum(axis=1))
    t = np.clip(2.0 - 2.0 * overlap[some] / (_TIMES * inside + slack[some]), 0.0, 1.0)
    out[some] *= t * t * (3.0 - 2.0 * t)
    return out


_Side: TypeAlias = tuple[ContactSurface, Ints32]
"""A surface and its facets' labels."""


def _depths(
    asked: Ints32, one: _Side, other: _Side, joined: NDArray[np.uint8], x: Array, reach: float, threads: int
) -> Array:
    """How deep the corners of facets (Q,) of one side are inside what the other belongs to [m], shape (Q, 4)."""
    import warp as wp
    from warpjld_kernels import contact_near

    (mine, my_labels), (others, labels) = one, other
    origin = x[others.nodes].mean(axis=0)
    corners = x[others.quads] - origin
    boxes = (np.ascontiguousarray(b, dtype=np.float32) for b in (corners.min(axis=1), corners.max(axis=1)))
    bvh = wp.Bvh(*(wp.array(b, dtype=wp.vec3, device="cpu") for b in boxes))
    tables = [shared(np.ascontiguousarray(a)) for a in (mine.quads, my_labels, others.quads, labels, joined)]
    nodes = wp.array(np.ascontiguousarray(x), dtype=wp.vec3d, device="cpu", copy=False)
    out = np.empty((len(asked), 4))
    arguments = [bvh.id, wp.vec3d(*origin), *tables, nodes, shared(asked.astype(np.int32)), reach, shared(out)]
    on_rows(contact_near.depths, len(asked), arguments, threads=threads, least=50)
    return out
