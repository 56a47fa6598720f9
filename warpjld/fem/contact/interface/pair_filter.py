"""Filter of facet pairs that face each other through a thin body and falsely appear to penetrate.

With two fingers side by side, the back of one faces the palmar side of the other like penetrating surfaces, a whole
finger deep; where their sides touch, slivers of such facets overlap in projection, and one finger would be pushed out
through the other. At the bottom of a crease, nodal normals differ much from those of the facets around, and an opposite
facet appears to lie behind the node. The far side of a fingertip of few facets faces what the near side touches. The
test: facets with a real penetration of some depth lie that deep inside the other body.
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
"""A pair is discarded if its penetration along the normal exceeds the first number times its real depth plus the second
number of edges; it counts fully below half of that."""
_OWN_SLACK = 1.0
"""The second number for parts that belong together (``Exclusion.joined``), whose real depth is not known because they
overlap where they are joined."""


def counted_share(mortar: Mortar, pairs: Ints32, integrals: Array, normals: Array, x: Array, reach: float) -> Array:
    """Fraction with which facet pairs (P, 2) count, 0 for false penetrations, shape (P,).

    Args:
        mortar: The two surfaces.
        pairs: Facets that face each other.
        integrals: Their mortar integrals (see the kernel), shape (P, 33).
        normals: Normals at the slave's nodes, shape (m, 3).
        x: Positions of the body's nodes [m], shape (N, 3).
        reach: Search distance [m].
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
    deep = np.flatnonzero(overlap > 0.5 * slack)
    if not len(deep):
        return out
    inside = np.zeros(len(deep))
    sides: list[_Side] = [(slave, mine), (master, others)]
    for side, shares in enumerate((own, far)):
        facets, rows = np.unique(pairs[deep, side], return_inverse=True)
        depth = _depths(facets, sides[side], sides[1 - side], mortar.joined, x, reach, mortar.threads)[rows]
        inside = np.maximum(inside, (shares[deep] * depth).sum(axis=1))
    t = np.clip(2.0 - 2.0 * overlap[deep] / (_TIMES * inside + slack[deep]), 0.0, 1.0)
    out[deep] *= t * t * (3.0 - 2.0 * t)
    return out


_Side: TypeAlias = tuple[ContactSurface, Ints32]
"""A surface and its facets' labels."""


def _depths(
    facets: Ints32, one: _Side, other: _Side, joined: NDArray[np.uint8], x: Array, reach: float, threads: int
) -> Array:
    """Depth of the corners of facets (Q,) of one side inside the body of the other side [m], shape (Q, 4)."""
    import warp as wp
    from warpjld_kernels import contact_near

    (mine, my_labels), (others, labels) = one, other
    origin = x[others.nodes].mean(axis=0)
    corners = x[others.quads] - origin
    boxes = (np.ascontiguousarray(b, dtype=np.float32) for b in (corners.min(axis=1), corners.max(axis=1)))
    bvh = wp.Bvh(*(wp.array(b, dtype=wp.vec3, device="cpu") for b in boxes))
    tables = [shared(np.ascontiguousarray(a)) for a in (mine.quads, my_labels, others.quads, labels, joined)]
    nodes = wp.array(np.ascontiguousarray(x), dtype=wp.vec3d, device="cpu", copy=False)
    out = np.empty((len(facets), 4))
    arguments = [bvh.id, wp.vec3d(*origin), *tables, nodes, shared(facets.astype(np.int32)), reach, shared(out)]
    on_rows(contact_near.depths, len(facets), arguments, threads=threads, least=50)
    return out
