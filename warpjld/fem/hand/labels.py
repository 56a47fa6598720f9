"""Which segment every part of the skin belongs to, and which parts never touch one another (R126, R127)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.skeleton.hand import DIGITS

__all__ = ["WEB", "excluded_pairs", "fringes", "joined_pairs", "segment_name", "skin_labels"]

_ENDS = {"tip": "distal", "knuckle3": "middle", "knuckle2": "proximal", "base": "palm", "carpometacarpal": "wrist"}
_THUMB = {"tip": "distal", "knuckle3": "proximal", "knuckle2": "palm", "base": "wrist"}
_BETWEEN = "middle"
"""Phalanx between a finger's first and last; thumbs have none."""
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
    digit at rest are webs: they get labels of their own, so that excluding them leaves the rest of the digit. Labels of
    the palm come first, then digit by digit: of two labels one is the slave of the other, and along the border of two
    labels of the palm, or of a web, a fingertip must not change sides.

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
    return _grouped(out, names)


def _grouped(label: NDArray[np.int32], names: Sequence[str]) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """Labels and their names in another order, those of the palm first and those of a digit together."""
    digits = list(dict.fromkeys(["", *map(_digit, names)]))
    order = sorted(range(len(names)), key=lambda k: digits.index(_digit(names[k])))
    rank = np.empty(len(names), np.int32)
    rank[order] = np.arange(len(names))
    return rank[label], tuple(names[k] for k in order)


def joined_pairs(names: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of labels that belong together, symmetric, shape (L, L).

    They are: a label with itself; segments of one digit; a first phalanx and its metacarpal; parts of the palm and the
    wrist.
    """
    count = len(names)
    out = np.eye(count, dtype=bool)
    for a in range(count):
        for b in range(a):
            joined = _base_of(names[a], names[b]) or _base_of(names[b], names[a])
            out[a, b] = out[b, a] = _digit(names[a]) == _digit(names[b]) or joined
    return out


def fringes(
    mesh: HexMesh, faces: NDArray[np.int32], label: NDArray[np.int32], names: Sequence[str], width: float
) -> NDArray[np.float64]:
    """Share with which faces of a finger's first and last phalanx meet each other, shape (F,).

    Where they border on the phalanx between them, which never meets its neighbours, they do not; it grows from there.

    Args:
        mesh: At rest.
        faces: Skin faces, shape (F, 2).
        label: Their labels, shape (F,).
        names: Names of the labels.
        width: Distance from that phalanx at which they meet as others do [m].
    """
    from scipy.spatial import cKDTree

    middle = mesh.nodes[mesh.quads(faces)].mean(axis=1)
    digit = np.array([_digit(name) for name in names])[label]
    between = np.array([_segment(name) == _BETWEEN for name in names])[label]
    out = np.ones(len(faces))
    for own in set(digit[between].tolist()):
        mine = np.flatnonzero((digit == own) & ~between)
        away, _ = cKDTree(middle[between & (digit == own)]).query(middle[mine])
        t = np.clip(away / width - 0.5, 0.0, 1.0)
        out[mine] = t * t * (3.0 - 2.0 * t)
    return out


def excluded_pairs(
    mesh: HexMesh, faces: NDArray[np.int32], label: NDArray[np.int32], names: Sequence[str], near: float
) -> NDArray[np.bool_]:
    """Pairs of labels that are never tested for contact, symmetric, shape (L, L) (R127).

    They are those that belong together (``joined_pairs``), but for the first phalanx of a finger and its last, which
    meet in a tight fist; and whatever lies within ``near`` of one another at rest: webs, and digits drawn side by side.

    Args:
        mesh: At rest.
        faces: Skin faces, shape (F, 2).
        label: Their labels, shape (F,).
        names: Names of the labels.
        near: [m]
    """
    from scipy.spatial import cKDTree

    count = len(names)
    out = joined_pairs(names) & ~_ends(names)
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
    *side, kind, digit = palm.removesuffix(WEB).rsplit(".", 2)
    return kind == "palm" and phalanx.removesuffix(WEB) == ".".join([*side, digit, "proximal"])


def _segment(name: str) -> str:
    """``distal`` of ``left.index.distal``."""
    return name.removesuffix(WEB).rpartition(".")[2]


def _ends(names: Sequence[str]) -> NDArray[np.bool_]:
    """Pairs of the first and last of a finger's three phalanges, shape (L, L)."""
    digit = np.array([_digit(name) for name in names])
    segment = np.array([_segment(name) for name in names])
    long = np.isin(digit, digit[segment == _BETWEEN])
    first, last = long & (segment == "proximal"), long & (segment == "distal")
    pairs = (first[:, None] & last | last[:, None] & first) & (digit[:, None] == digit)
    return np.asarray(pairs)
