"""Completion of a body's tree: coincident pelvis joints are merged, extremities are added (R13)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.extremity import find_extremity
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.section import nearby
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["find_extremities", "merge_pelvis"]

_EXPECTED = {"ball": 0.4, "wrist": 0.7, "head": 1.2}  # length of the end segment, per length of its parent bone
_SAME = 1e-3  # distance below which joints coincide, per size of the body


def merge_pelvis(tree: SourceTree, roles: Roles) -> NDArray[np.float64] | None:
    """Place the pelvis where spine and legs meet, merging a root and several bones that start there.

    Removes the lowest spine joint from ``roles`` if it coincides with the pelvis; the others are renumbered.

    Returns:
        Position of the pelvis, or None where the body has none.
    """
    if "pelvis" not in roles.body:
        return None
    at = tree.positions
    pelvis = roles.body["pelvis"]
    size = float(np.linalg.norm(np.ptp(at, axis=0)))
    place: NDArray[np.float64] = at[pelvis]
    below = [c for c in tree.children[pelvis] if set(tree.subtree(c)) & set(roles.body.values())]
    if len(below) > 1 and all(np.linalg.norm(at[c] - at[below[0]]) < _SAME * size for c in below):
        place = at[below[0]]
        if np.linalg.norm(place - at[pelvis]) > _SAME * size:
            roles.notes.append(f"pelvis: '{tree.names[pelvis]}' lies apart, placed where spine and legs part")
    spine = [roles.body.pop(f"spine{n}") for n in range(1, 1 + sum(name.startswith("spine") for name in roles.body))]
    if spine and np.linalg.norm(at[spine[0]] - place) < _SAME * size:
        roles.notes.append(f"{tree.names[spine.pop(0)]}: shares the pelvis's place, part of it")
    roles.body |= {f"spine{n}": joint for n, joint in enumerate(spine, start=1)}
    return place


def find_extremities(
    places: Mapping[str, NDArray[np.float64]],
    parents: Mapping[str, str | None],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
) -> dict[str, tuple[str, NDArray[np.float64]]]:
    """Ends of toes, head and arms without hands, which most files leave out.

    Args:
        places: Canonical joints → positions [m].
        parents: Their parents.
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).

    Returns:
        New canonical name → (parent joint, position [m]).
    """
    out: dict[str, tuple[str, NDArray[np.float64]]] = {}
    for name in sorted(set(places) - set(parents.values())):
        tip, above = _extremity_name(name), parents[name]
        if tip is None or above is None:
            continue
        if name == "head":
            above = next((n for n in ("neck1", "spine1", "pelvis") if n in places), above)
        bone = places[name] - places[above]
        length = float(np.linalg.norm(bone))
        expected = length * _EXPECTED.get(name.rpartition(".")[2], 1.0)
        near = nearby(vertices, faces, places[name], 4.0 * expected)
        found = find_extremity(vertices, near, places[name], bone / length, expected)
        if found is not None:
            out[tip] = (name, found)
    return out


def _extremity_name(name: str) -> str | None:
    side, _, part = name.partition(".")
    if name == "head":
        return "head.top"
    if part == "ball":
        return f"{side}.toe.tip"
    if part == "wrist" and side:
        return f"{side}.hand.tip"
    if part.startswith("toe") and not part.endswith("tip"):
        return f"{side}.{part.partition('.')[0]}.tip"
    return None
