"""Skin weights over a rig's own joints, for formats whose readers do the skinning."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.segment_distance import segment_distance
from warpjld.motion.out.source_motion import SourceMotion
from warpjld.rig import Rig, Skin

__all__ = ["joint_weights"]

_SMALLEST = 1e-3  # smallest weight that is written, per largest of the vertex


def joint_weights(rig: Rig, motion: SourceMotion, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Joints of ``motion`` and their weights at every welded vertex, strongest first, shapes (V, 4 k).

    Painted weights if the rig has them; else weights of the geometry's domains, with a note.
    """
    skin = rig.skin
    if skin is None:
        skin = _bound(rig)
        notes.append(
            "the rig has no painted weights: the file's skin follows its joints by weights worked out from the "
            "geometry; the deformed surface itself is in the vertex caches"
        )
    if rig.rigid is not None:
        fixed = rig.rigid >= 0
        joints, weights = skin.joints.copy(), skin.weights.copy()
        joints[fixed], weights[fixed] = rig.rigid[fixed, None], 0.0
        weights[fixed, 0] = 1.0
        skin = Skin(joints, weights)
    into = _sources(rig, motion)
    dense = np.zeros((len(skin.joints), len(motion.tree)))
    np.add.at(dense, (np.arange(len(dense))[:, None], into[skin.joints]), skin.weights)
    dense[dense < _SMALLEST * dense.max(axis=1, keepdims=True)] = 0.0
    dense /= dense.sum(axis=1, keepdims=True)
    width = min(4 * -(-int((dense > 0.0).sum(axis=1).max()) // 4), dense.shape[1])
    strongest = np.argsort(-dense, axis=1, kind="stable")[:, :width]
    weights = np.take_along_axis(dense, strongest, axis=1)
    joints = np.where(weights > 0.0, strongest, 0)
    spare = ((0, 0), (0, -width % 4))
    return np.pad(joints, spare), np.pad(weights, spare)


def _sources(rig: Rig, motion: SourceMotion) -> NDArray[np.int64]:
    """Joint of the file that each joint of the skeleton moves with: its own; for added ones that of an ancestor."""
    if rig.source is None:
        return np.arange(len(rig.skeleton))
    out = np.array(rig.sources)
    for j, parent in enumerate(rig.skeleton.parents.tolist()):
        if out[j] < 0 and parent >= 0:
            out[j] = out[parent]
    return np.where(out >= 0, out, np.flatnonzero(np.array(rig.sources) >= 0)[:1].sum())


def _bound(rig: Rig) -> Skin:
    """Weights from the covering's domains: each operator's weight is shared among the joints of its segments, by
    distance from the vertex to the power of -4."""
    from warpjld.covering.domains import domains_from_geometry
    from warpjld.covering.operators import fans

    groups = fans(rig.skeleton)
    vertices = rig.surface.vertices
    domains = domains_from_geometry(vertices, rig.surface.faces, rig.skeleton, groups)
    dense = np.zeros((len(vertices), len(rig.skeleton)))
    for group, weight in zip(groups, domains.T, strict=True):
        touched = np.flatnonzero(weight)
        near = np.column_stack(
            [segment_distance(vertices[touched], rig.skeleton.rest, [(s.proximal, s.distal)]) for s in group.segments]
        )
        share = np.maximum(near, 1e-9) ** -4.0
        share /= share.sum(axis=1, keepdims=True)
        for k, segment in enumerate(group.segments):
            dense[touched, segment.proximal] += weight[touched] * share[:, k]
    joints = np.tile(np.arange(len(rig.skeleton), dtype=np.int32), (len(vertices), 1))
    return Skin(joints, dense)
