"""Which segment every part of the skin belongs to, and which parts never touch one another (R126, R127)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hexmesh import HexMesh
from warpjld.skeleton.hand import DIGITS

__all__ = ["WEB", "excluded_pairs", "joined_pairs", "segment_name", "skin_labels"]

_ENDS = {"tip": "distal", "knuckle3": "middle", "knuckle2": "proximal", "base": "palm", "carpometacarpal": "wrist"}
_THUMB = {"tip": "distal", "knuckle3": "proximal", "knuckle2": "palm", "base": "wrist"}
WEB = ".web"
"""Ends the label of skin near another digit at rest: where fingers part, and sides that lie together."""


def segment_name(joint: str) -> str:
    """What the segment that ends at a joint is called: ``index.distal``, ``palm.index``, ``thumb.proximal``, ``wrist``.

    Joints that belong to no hand keep their own name. The side is kept in front: ``left.index.distal``.
    """
    parts = joint.split(".")
    side = parts[0] + "." if parts[0] in ("left", "right") else ""
    name = parts[-1]
    digit = parts[-2] if len(parts) > 1 else ""
    if digit not in DIGITS:
        return joint
    segment = (_THUMB if digit == "thumb" else _ENDS).get(name, name)
    if segment == "wrist":
        return f"{side}wrist"
    return f"{side}palm.{digit}" if segment == "palm" else f"{side}{digit}.{segment}"


def skin_labels(
    mesh: HexMesh, faces: NDArray[np.int32], weights: NDArray[np.float64], joints: Sequence[str], near: float
) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """Label of each skin face, and the names of the labels.

    A face belongs to the segment whose bone carries most of it. Parts of the digits that lie within ``near`` of another
    digit at rest are webs: they get labels of their own, so that excluding them leaves the rest of the digit.

    Args:
        mesh: At rest.
        faces: Skin faces, shape (F, 2).
        weights: Weights of the bones on the nodes, shape (N, B).
        joints: Joint at the far end of each bone.
        near: [m]
    """
    from scipy.spatial import cKDTree

    named = [segment_name(joint) for joint in joints]
    names = list(dict.fromkeys(named))
    quads = mesh.quads(faces)
    share = np.zeros((len(faces), len(names)))
    for bone, name in enumerate(named):
        share[:, names.index(name)] += weights[quads, bone].sum(axis=1)
    label = share.argmax(axis=1).astype(np.int32)
    middle = mesh.nodes[quads].mean(axis=1)
    digit = np.array([_digit(name) for name in names])[label]
    webs: dict[int, int] = {}
    out = label.copy()
    for own in sorted(set(digit.tolist()) - {""}):
        mine, others = np.flatnonzero(digit == own), np.flatnonzero((digit != own) & (digit != ""))
        if len(others) == 0:
            continue
        away, _ = cKDTree(middle[others]).query(middle[mine])
        for face in mine[away < near]:
            kind = int(label[face])
            if kind not in webs:
                webs[kind] = len(names)
                names.append(names[kind] + WEB)
            out[face] = webs[kind]
    return out, tuple(names)


def joined_pairs(names: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of labels that belong together, symmetric, shape (L, L) (R127).

    They are: a label with itself; neighbouring phalanges, and the first one with its metacarpal; parts of the palm and
    the wrist. The last phalanx of a finger meets its first in a tight fist.
    """
    count = len(names)
    out = np.eye(count, dtype=bool)
    for a in range(count):
        for b in range(a):
            one, other = names[a].removesuffix(WEB), names[b].removesuffix(WEB)
            digit = _digit(one)
            if digit == _digit(other):
                together = digit == "" or {_segment(one), _segment(other)} != {"proximal", "distal"} or _short(digit)
            else:
                together = _base_of(one, other) or _base_of(other, one)
            out[a, b] = out[b, a] = together
    return out


def excluded_pairs(
    mesh: HexMesh, faces: NDArray[np.int32], label: NDArray[np.int32], names: Sequence[str], near: float
) -> NDArray[np.bool_]:
    """Pairs of labels that are never tested for contact, symmetric, shape (L, L) (R127).

    They are those that belong together (``joined_pairs``), and whatever lies within ``near`` of one another at rest
    (webs, and digits drawn side by side).

    Args:
        mesh: At rest.
        faces: Skin faces, shape (F, 2).
        label: Their labels, shape (F,).
        names: Names of the labels.
        near: [m]
    """
    from scipy.spatial import cKDTree

    count = len(names)
    out = joined_pairs(names)
    quads = mesh.quads(faces)
    points = np.concatenate([mesh.nodes[quads].reshape(-1, 3), mesh.nodes[quads].mean(axis=1)])
    kinds = np.concatenate([np.repeat(label, 4), label])
    trees = [cKDTree(points[kinds == k]) if (kinds == k).any() else None for k in range(count)]
    for a in range(count):
        for b in range(a):
            one, other = trees[a], trees[b]
            if out[a, b] or one is None or other is None:
                continue
            if one.sparse_distance_matrix(other, near, output_type="coo_matrix").nnz:
                out[a, b] = out[b, a] = True
    return out


def _digit(name: str) -> str:
    """Digit with its side, or nothing for palm, wrist and forearm."""
    parts = name.removesuffix(WEB).split(".")
    if len(parts) > 1 and parts[-2] in DIGITS:
        return ".".join(parts[:-1])
    return ""


def _base_of(palm: str, phalanx: str) -> bool:
    """Whether a part of the palm lies over the metacarpal that carries this first phalanx."""
    *side, kind, digit = palm.rsplit(".", 2)
    return kind == "palm" and phalanx == ".".join([*side, digit, "proximal"])


def _segment(name: str) -> str:
    """``distal`` of ``left.index.distal``."""
    return name.rpartition(".")[2]


def _short(digit: str) -> bool:
    """Whether a digit has two phalanges, which are neighbours."""
    return _segment(digit) == "thumb"
