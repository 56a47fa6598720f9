"""Labels of the skin by segment, and pairs of labels that are excluded from contact (R126, R127)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.skeleton.hand import DIGITS

__all__ = ["WEB", "creases", "excluded_pairs", "fringes", "joined_pairs", "segment_name", "skin_labels"]

_ENDS = {"tip": "distal", "knuckle3": "middle", "knuckle2": "proximal", "base": "palm", "carpometacarpal": "wrist"}
"""Segment that ends at a finger's joint."""
_THUMB = {"tip": "distal", "knuckle3": "proximal", "knuckle2": "palm", "base": "wrist"}
"""Segment that ends at a thumb's joint."""
_FOLDING = ("elbow", "knee")
"""Joints at which flesh on both sides comes into contact when they are flexed."""
_CREASED = 0.4
"""Width of the transition at a crease, relative to that next to an excluded phalanx."""
_BETWEEN = "middle"
"""Phalanx between a finger's first and last; a thumb has none."""
WEB = ".web"
"""Suffix of labels of skin near another digit at rest: between fingers, and on adjacent sides."""


def segment_name(joint: str) -> str:
    """Name of the segment that ends at a joint: ``index.distal``, ``palm.index``, ``thumb.proximal``, ``wrist``.

    Joints that belong to no hand keep their names. The side is kept as a prefix: ``left.index.distal``.
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

    A face belongs to the segment whose bone has the largest weight. Faces of a digit within ``near`` of another digit
    at rest are webs, with labels of their own, so that excluding them does not exclude the rest of the digit. Labels of
    the palm come first, then those of each digit: their order decides which of two labels is the slave, and a fingertip
    on the border of two labels of the palm, or of a web, must not switch between slave and master.

    Args:
        mesh: Mesh at rest.
        faces: Skin faces, shape (F, 2).
        weights: Weights of the bones at the nodes, shape (N, B).
        joints: Distal joint of each bone.
        near: Distance to other digits below which skin is web [m].
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
    return _reordered(out, names)


def _reordered(label: NDArray[np.int32], names: Sequence[str]) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """Labels and their names, reordered such that the palm's come first and a digit's are contiguous."""
    digits = list(dict.fromkeys(["", *map(_digit, names)]))
    order = sorted(range(len(names)), key=lambda k: digits.index(_digit(names[k])))
    rank = np.empty(len(names), np.int32)
    rank[order] = np.arange(len(names))
    return rank[label], tuple(names[k] for k in order)


def creases(names: Sequence[str], joints: Sequence[str], parents: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of labels on both sides of a fold: upper arm and forearm, thigh and shin, symmetric, shape (L, L).

    Args:
        names: Of the labels.
        joints: Distal joint of each bone.
        parents: Proximal joint of each bone.
    """
    out = np.zeros((len(names), len(names)), dtype=bool)
    ends = {segment_name(joint): (joint, parent) for joint, parent in zip(joints, parents, strict=True)}
    for a, one in enumerate(names):
        for b, other in enumerate(names):
            if one in ends and other in ends and ends[one][0] == ends[other][1]:
                out[a, b] |= ends[one][0].rpartition(".")[2] in _FOLDING
    return out | out.T


def joined_pairs(names: Sequence[str], joints: Sequence[str], parents: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of labels that belong together, symmetric, shape (L, L).

    These are: a label with itself; segments of one digit; a first phalanx and its metacarpal; parts of the palm and the
    wrist; segments of a body that share a joint.

    Args:
        names: Of the labels.
        joints: Distal joint of each bone.
        parents: Proximal joint of each bone.
    """
    count = len(names)
    out = np.eye(count, dtype=bool)
    ends: dict[str, set[str]] = {}
    for joint, parent in zip(joints, parents, strict=True):
        ends.setdefault(segment_name(joint), set()).update((joint, parent))
    for a in range(count):
        for b in range(a):
            one, other = names[a], names[b]
            joined = _base_of(one, other) or _base_of(other, one) or (_digit(one) == _digit(other) != "")
            if not joined and _digit(one) == _digit(other) == "":
                joined = (_palmar(one) and _palmar(other)) or bool(ends.get(one, set()) & ends.get(other, set()))
            out[a, b] = out[b, a] = joined
    return out


def _palmar(name: str) -> bool:
    """Whether a label belongs to a palm and its wrist."""
    words = name.removesuffix(WEB).split(".")
    return "palm" in words or words[-1] in ("wrist", "forearm")


def fringes(
    mesh: HexMesh,
    faces: NDArray[np.int32],
    label: NDArray[np.int32],
    names: Sequence[str],
    width: float,
    folds: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Contact factor between faces of a finger's first and last phalanx, and on either side of a crease, shape (F,).

    It is 0 at the border to the phalanx between them, which is excluded from contact with both, or to the other side,
    and grows from there.

    Args:
        mesh: Mesh at rest.
        faces: Skin faces, shape (F, 2).
        label: Their labels, shape (F,).
        names: Names of the labels.
        width: Width of the transition [m]: the factor is 0 up to half a width from that border, 1 from 1.5 widths.
        folds: Pairs of labels on both sides of a fold, shape (L, L).
    """
    from scipy.spatial import cKDTree

    middle = mesh.nodes[mesh.quads(faces)].mean(axis=1)
    digit = np.array([_digit(name) for name in names])[label]
    between = np.array([_segment(name) == _BETWEEN for name in names])[label]
    out = np.ones(len(faces))
    for own in set(digit[between].tolist()):
        mine = np.flatnonzero((digit == own) & ~between)
        away, _ = cKDTree(middle[between & (digit == own)]).query(middle[mine])
        out[mine] = _grown(away / width)
    for a, b in zip(*np.nonzero(folds), strict=True):
        mine, others = np.flatnonzero(label == a), np.flatnonzero(label == b)
        if len(mine) and len(others):
            away, _ = cKDTree(middle[others]).query(middle[mine])
            out[mine] = np.minimum(out[mine], _grown(away / (_CREASED * width)))
    return out


def _grown(away: NDArray[np.float64]) -> NDArray[np.float64]:
    """Contact factor at distances from a border, in widths of the transition."""
    t = np.clip(away - 0.5, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def excluded_pairs(
    mesh: HexMesh,
    faces: NDArray[np.int32],
    label: NDArray[np.int32],
    names: Sequence[str],
    near: float,
    joined: NDArray[np.bool_],
    folds: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Pairs of labels that are excluded from contact, symmetric, shape (L, L) (R127, R140).

    These are pairs that belong together, except for a finger's first and last phalanx, which touch in a tight fist, and
    the two sides of a crease; all pairs within ``near`` of each other at rest: webs, and digits modelled side by side;
    and pairs that cannot reach each other, such as foot and face.

    Args:
        mesh: Mesh at rest.
        faces: Skin faces, shape (F, 2).
        label: Their labels, shape (F,).
        names: Names of the labels.
        near: Distance below which pairs are excluded [m].
        joined: Pairs that belong together, shape (L, L).
        folds: Pairs on both sides of a fold, shape (L, L).
    """
    from scipy.spatial import cKDTree

    count = len(names)
    out = joined & ~_ends(names) & ~folds | _unreachable(names)
    quads = mesh.quads(faces)
    points = np.concatenate([mesh.nodes[quads].reshape(-1, 3), mesh.nodes[quads].mean(axis=1)])
    kinds = np.concatenate([np.repeat(label, 4), label])
    trees = [cKDTree(points[kinds == k]) if (kinds == k).any() else None for k in range(count)]
    for a in range(count):
        for b in range(a):
            one, other = trees[a], trees[b]
            if out[a, b] or folds[a, b] or one is None or other is None:
                continue
            if one.sparse_distance_matrix(other, near, output_type="coo_matrix").nnz:
                out[a, b] = out[b, a] = True
    return out


def _unreachable(names: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of labels that cannot reach each other at any joint angles, symmetric, shape (L, L)."""
    words = [name.removesuffix(WEB).split(".")[-1].rstrip("0123456789") for name in names]
    whole = [name.removesuffix(WEB).split(".") for name in names]
    low = np.array(
        [bool({"toe1", "toe3", "toe5"} & set(w)) or word in _FEET for w, word in zip(whole, words, strict=True)]
    )
    high = np.array([word in _HEADS for word in words])
    return np.asarray(low[:, None] & high | high[:, None] & low)


_FEET = ("ankle", "heel", "ball")
_HEADS = ("neck", "head", "top", "chin", "nose_tip")


def _digit(name: str) -> str:
    """Digit with its side; empty for palm, wrist and forearm."""
    parts = name.removesuffix(WEB).split(".")
    if len(parts) > 1 and parts[-2] in DIGITS:
        return ".".join(parts[:-1])
    return ""


def _base_of(palm: str, phalanx: str) -> bool:
    """Whether a part of the palm lies over the metacarpal that carries this proximal phalanx."""
    *side, kind, digit = palm.removesuffix(WEB).rsplit(".", 2)
    return kind == "palm" and phalanx.removesuffix(WEB) == ".".join([*side, digit, "proximal"])


def _segment(name: str) -> str:
    """Last part of a name: ``distal`` of ``left.index.distal``."""
    return name.removesuffix(WEB).rpartition(".")[2]


def _ends(names: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of the first and last of a finger's three phalanges, shape (L, L)."""
    digit = np.array([_digit(name) for name in names])
    segment = np.array([_segment(name) for name in names])
    long = np.isin(digit, digit[segment == _BETWEEN])
    first, last = long & (segment == "proximal"), long & (segment == "distal")
    pairs = (first[:, None] & last | last[:, None] & first) & (digit[:, None] == digit)
    return np.asarray(pairs)
