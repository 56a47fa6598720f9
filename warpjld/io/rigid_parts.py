"""Detection of rigid pieces of a surface: eyes, teeth, nails, buttons, armour, which follow a single bone.

A piece is a component connected by faces or coincident vertices, so that a body split by materials is one piece. A
piece is rigid if no bone lies inside it, and

* it is painted to one joint, or
* without painted weights, it is closed and no larger than the bone nearest to it.

The largest piece is never rigid. Clothes, which contain bones, are deformable, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.coincident import close_links, connected_parts
from warpjld.geometry.surface import Surface
from warpjld.geometry.winding import winding_numbers
from warpjld.listed import first_few
from warpjld.rig import Skin
from warpjld.skeleton.tree import Skeleton

__all__ = ["rigid_parts"]

_SHARE = 0.9  # smallest share of a piece's weight on one joint at which the piece counts as painted to that joint
_SAMPLES = 15  # samples along a bone
_WITHIN = 0.5  # smallest share of samples inside a piece at which the piece contains the bone
_SAME_PLACE = 1e-6  # distance at which vertices coincide, per size of the surface


def rigid_parts(
    surface: Surface, skeleton: Skeleton, skin: Skin | None, rigid: NDArray[np.int32] | None
) -> tuple[NDArray[np.int32] | None, tuple[str, ...]]:
    """Joint that every vertex follows rigidly, -1 if deformable, shape (V,), or None if all are; and notes.

    Args:
        surface: The rest surface.
        skeleton: The rest skeleton.
        skin: Painted weights, or None.
        rigid: Rigid vertices stated by the file, in the same form, which are kept.
    """
    count = len(surface.vertices)
    out = np.full(count, -1, dtype=np.int32) if rigid is None else rigid.copy()
    pieces = [p for p in _pieces(surface) if (out[p[0]] < 0).all()]
    pieces.sort(key=lambda p: -_area(surface, p[1]))
    found: dict[int, list[str]] = {}
    for vertices, faces in pieces[1:]:
        joint = _nearest_bone(surface, skeleton, vertices, faces) if skin is None else _painted(skin, vertices)
        if joint < 0 or _holds_a_bone(surface, skeleton, vertices, faces):
            continue
        out[vertices] = joint
        found.setdefault(joint, []).append(_name(surface, int(vertices[0])))
    notes = tuple(
        f"{len(names)} separate piece{'s' * (len(names) > 1)} without flesh, rigid to joint "
        f"'{skeleton.names[joint]}': {first_few(list(dict.fromkeys(names)))}"
        for joint, names in found.items()
    )
    return (out if (out >= 0).any() else None), notes


def _pieces(surface: Surface) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Vertex and face indices of every connected piece."""
    count = len(surface.vertices)
    pairs = close_links(surface.vertices, _SAME_PLACE * surface.size)
    label = connected_parts(np.concatenate([surface.faces[:, :2], surface.faces[:, 1:], pairs]), count)
    number = int(label.max()) + 1
    of_face = label[surface.faces[:, 0]]
    vertices = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label, minlength=number))[:-1])
    faces = np.split(np.argsort(of_face, kind="stable"), np.cumsum(np.bincount(of_face, minlength=number))[:-1])
    return [(v, f) for v, f in zip(vertices, faces, strict=True) if len(f)]


def _area(surface: Surface, faces: NDArray[np.int64]) -> float:
    a, b, c = (surface.vertices[surface.faces[faces, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0


def _painted(skin: Skin, vertices: NDArray[np.int64]) -> int:
    """The joint with nearly all the weight of a piece, or -1."""
    total = np.bincount(skin.joints[vertices].ravel(), weights=skin.weights[vertices].ravel())
    joint = int(total.argmax())
    return joint if total[joint] > _SHARE * total.sum() else -1


def _nearest_bone(surface: Surface, skeleton: Skeleton, vertices: NDArray[np.int64], faces: NDArray[np.int64]) -> int:
    """Proximal joint of the bone nearest to a closed piece, or -1 if the piece is open or larger than that bone."""
    triangles = surface.faces[faces]
    edges = np.sort(np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
    if (np.unique(edges, axis=0, return_counts=True)[1] != 2).any():
        return -1
    points = surface.vertices[vertices]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    start, along = _bones(skeleton)
    t = np.clip(((middle - start) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    nearest = int(np.linalg.norm(middle - start - t[:, None] * along, axis=1).argmin())
    if np.linalg.norm(np.ptp(points, axis=0)) > np.linalg.norm(along[nearest]):
        return -1
    return skeleton.segments[nearest].proximal


def _holds_a_bone(surface: Surface, skeleton: Skeleton, vertices: NDArray[np.int64], faces: NDArray[np.int64]) -> bool:
    start, along = _bones(skeleton)
    places = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    samples = start[:, None] + places[:, None] * along[:, None]
    points = surface.vertices[vertices]
    inside = ((samples >= points.min(axis=0)) & (samples <= points.max(axis=0))).all(axis=2)
    inside[inside.sum(axis=1) < _WITHIN * _SAMPLES] = False
    if not inside.any():
        return False
    around = np.abs(winding_numbers(surface.vertices, surface.faces[faces], samples[inside])) > 0.5
    inside[inside] = around
    return bool((inside.sum(axis=1) >= _WITHIN * _SAMPLES).any())


def _bones(skeleton: Skeleton) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    ends = np.array([(s.proximal, s.distal) for s in skeleton.segments])
    start: NDArray[np.float64] = skeleton.rest[ends[:, 0]]
    return start, skeleton.rest[ends[:, 1]] - start


def _name(surface: Surface, vertex: int) -> str:
    """Name of the source's mesh that a vertex belongs to."""
    source = int(np.flatnonzero(surface.weld == vertex)[0])
    return next((p.name for p in surface.parts if p.vertices.start <= source < p.vertices.stop), "surface")
