"""Material region of every element of a hand: skin, flesh, bone, or tissue between the bones of a joint (R105)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.labels import segment_name
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.geometry.surface import Surface
from warpjld.skeleton.hand import DIGITS

__all__ = ["hand_regions", "shares_of_skin"]

_CARPAL = ("wrist", "forearm")
_SHARED = 0.1
"""Smallest weight of both bones at which an element between them belongs to their joint."""
_PARTS = 8
"""Shares of skin in an element are rounded to multiples of one over this number."""
_ACROSS = 5
"""Sample points along each edge of an element for its share of skin."""


def hand_regions(
    mesh: HexMesh,
    name: str,
    surface: Surface,
    skin: float,
    weights: NDArray[np.float64],
    joints: Sequence[str],
    bones: Sequence[int],
    parents: Sequence[int],
) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """Region of each element, shape (E,), and the regions' names.

    These are ``hand.flesh``, ``hand.skin``, ``hand.joint`` (flesh and skin between the bones of a joint, and between
    digits) and ``hand.bone``. The thickness of skin does not depend on the size of elements: one that it fills to three
    eighths belongs to ``hand.skin:3/8``.

    Args:
        mesh: Mesh with regions ``flesh`` and ``bone``.
        name: Prefix of the region names.
        surface: The surface of the skin.
        skin: Thickness of the skin [m].
        weights: Weight of each bone at every node, shape (N, B).
        joints: Name of the distal joint of each bone.
        bones: Indices of these joints in the skeleton.
        parents: Indices of the proximal joints.
    """
    parts = np.rint(_PARTS * shares_of_skin(mesh, Envelope(surface.vertices, surface.faces), skin)).astype(np.int32)
    out = np.where(_between(mesh, weights, joints, bones, parents), _PARTS + 1, parts)
    out = np.where(mesh.region("bone"), _PARTS + 2, out)
    mixed = [f"{name}.skin:{k}/{_PARTS}" for k in range(1, _PARTS)]
    names = np.array([f"{name}.flesh", *mixed, f"{name}.skin", f"{name}.joint", f"{name}.bone"])
    used = np.unique(np.concatenate([out, [0, _PARTS, _PARTS + 1, _PARTS + 2]]))
    return np.searchsorted(used, out).astype(np.int32), tuple(str(one) for one in names[used])


def shares_of_skin(mesh: HexMesh, envelope: Envelope, skin: float) -> NDArray[np.float64]:
    """Share of each element's volume within the skin's thickness [m] of a surface, shape (E,)."""
    depth = -envelope.ask(mesh.nodes).distance[mesh.elements]
    out = (depth.max(axis=1) < skin).astype(np.float64)
    partial = np.flatnonzero((depth.min(axis=1) < skin) & (depth.max(axis=1) >= skin))
    places = (np.arange(_ACROSS) + 0.5) / _ACROSS
    u, v, w = (grid.ravel() for grid in np.meshgrid(places, places, places, indexing="ij"))
    square = [(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]
    shape = np.stack([*(corner * (1 - w) for corner in square), *(corner * w for corner in square)])
    out[partial] = (depth[partial] @ shape < skin).mean(axis=1)
    return out


def _between(
    mesh: HexMesh,
    weights: NDArray[np.float64],
    joints: Sequence[str],
    bones: Sequence[int],
    parents: Sequence[int],
) -> NDArray[np.bool_]:
    """Mask of flesh elements shared by two bones that meet at a joint, or by two digits where they separate.

    Joints of the wrist, except for the thumb's, hardly move and are excluded.
    """
    share = weights[mesh.elements].mean(axis=1)
    out = np.zeros(len(mesh.elements), dtype=bool)
    names = [segment_name(joint).split(".") for joint in joints]
    for bone, near in enumerate(parents):
        for before, far in enumerate(bones):
            one, other = names[bone], names[before]
            fingers = "palm" in one and "palm" in other and "thumb" not in (one[-1], other[-1])
            digits = [name[-1] if "palm" in name else name[-2] if len(name) > 1 else "" for name in (one, other)]
            parted = not fingers and digits[0] != digits[1] and digits[0] in DIGITS and digits[1] in DIGITS
            carpal = one[-1] in _CARPAL or other[-1] in _CARPAL
            meet = near == far and (not carpal or "thumb" in (one[-1], other[-1]))
            if bone != before and (meet or parted):
                out |= np.minimum(share[:, bone], share[:, before]) > _SHARED
    return out
