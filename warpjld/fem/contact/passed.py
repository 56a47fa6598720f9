"""Facets of one surface that seem to overlap and do not.

Of two fingers side by side the back of one faces the palmar side of the other, as surfaces do that overlap, only a
whole finger deep. Where their sides touch, slivers of such facets lie one before the other, and one finger would be
pushed out through the other. In the bottom of a crease normals of nodes are far from those of the facets around, and
what is opposite a facet seems to be behind its node. What really overlaps so deep is that deep inside.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.pairs import Exclusion
from warpjld.fem.contact.surface import ContactSurface
from warpjld.fem.rows import on_rows, shared
from warpjld.rotations import unit

__all__ = ["counted"]

_TIMES, _SLACK = 3.0, 0.25
"""Overlap along the normal that counts for nothing: over how deep facets are inside each other, and that of facets that
only touch, in edges. Half of it counts fully."""
_OWN_SLACK = 1.0
"""The latter for parts that belong together, whose depth in each other is not known: they are inside one another where
they are joined."""


def counted(
    surface: ContactSurface,
    exclusion: Exclusion,
    pairs: NDArray[np.int32],
    integrals: NDArray[np.float64],
    normals: NDArray[np.float64],
    x: NDArray[np.float64],
    reach: float,
    threads: int,
) -> NDArray[np.float64]:
    """Share of pairs (P, 2) of a surface's facets that counts, 0 where they only seem to overlap, shape (P,).

    Args:
        surface: Against itself.
        exclusion: Says which parts belong together.
        pairs: Facets face to face.
        integrals: Of each, as the mortar kernel has them, shape (P, 33).
        normals: At the surface's nodes, shape (m, 3).
        x: Positions of the body's nodes [m], shape (N, 3).
        reach: Farthest that facets look at each other [m].
        threads: Threads.
    """
    joined = _joined(exclusion)[exclusion.slave[pairs[:, 0]], exclusion.master[pairs[:, 1]]]
    out = np.ones(len(pairs))
    if exclusion.fringe is not None:
        out[joined] = exclusion.fringe[pairs[joined]].min(axis=1)
    own = integrals[:, :16].reshape(-1, 4, 4).sum(axis=1)
    far = integrals[:, 16:32].reshape(-1, 4, 4).sum(axis=1)
    area = own.sum(axis=1, keepdims=True)
    own, far = own / area, far / area
    facing = unit(surface.area_vectors(x)[pairs[:, 0]])[:, None]
    facing = np.concatenate([facing, normals[surface.corners[pairs[:, 0]]]], axis=1)
    between = np.einsum("pk,pki->pi", far, x[surface.quads[pairs[:, 1]]])
    between -= np.einsum("pk,pki->pi", own, x[surface.quads[pairs[:, 0]]])
    overlap = -np.einsum("pki,pi->pk", facing, between).min(axis=1)
    slack = np.where(joined, _OWN_SLACK, _SLACK) * surface.edge[surface.corners[pairs[:, 0]]].mean(axis=1)
    some = np.flatnonzero(overlap > 0.5 * slack)
    if not len(some):
        return out
    asked, rows = np.unique(pairs[some], return_inverse=True)
    depth = _depths(surface, exclusion, asked.astype(np.int32), x, reach, threads)[rows.reshape(-1, 2)]
    inside = np.maximum((own[some] * depth[:, 0]).sum(axis=1), (far[some] * depth[:, 1]).sum(axis=1))
    t = np.clip(2.0 - 2.0 * overlap[some] / (_TIMES * inside + slack[some]), 0.0, 1.0)
    out[some] *= t * t * (3.0 - 2.0 * t)
    return out


def _joined(exclusion: Exclusion) -> NDArray[np.bool_]:
    return exclusion.never if exclusion.joined is None else exclusion.joined


def _depths(
    surface: ContactSurface,
    exclusion: Exclusion,
    asked: NDArray[np.int32],
    x: NDArray[np.float64],
    reach: float,
    threads: int,
) -> NDArray[np.float64]:
    """How deep the corners of facets (Q,) are inside parts that theirs do not belong to [m], shape (Q, 4)."""
    import warp as wp
    from warpjld_kernels import contact_near

    origin = x[surface.nodes].mean(axis=0)
    corners = x[surface.quads] - origin
    boxes = (np.ascontiguousarray(b, dtype=np.float32) for b in (corners.min(axis=1), corners.max(axis=1)))
    bvh = wp.Bvh(*(wp.array(b, dtype=wp.vec3, device="cpu") for b in boxes))
    label, joined = exclusion.slave.astype(np.int32), _joined(exclusion).astype(np.uint8)
    tables = [np.ascontiguousarray(a) for a in (surface.quads, label, joined)]
    nodes = wp.array(np.ascontiguousarray(x), dtype=wp.vec3d, device="cpu", copy=False)
    out = np.empty((len(asked), 4))
    arguments = [bvh.id, wp.vec3d(*origin), *(shared(t) for t in tables), nodes, shared(asked), reach, shared(out)]
    on_rows(contact_near.depths, len(asked), arguments, threads=threads, least=50)
    return out
