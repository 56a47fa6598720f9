"""Skin owned by each joint: distinguishes joints that move a body from helpers, ends, sockets and controls."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.roles import BY_MAP
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["JointFlesh", "flesh_shares", "without_flesh"]

_NONE = 1e-6  # share of the surface up to which a joint owns no skin
_COINCIDENT = 1e-3  # an end nearer than this, per length of the bone before, coincides with its joint
_LONGEST_END, _MOST_TURNED = 2.5, np.cos(np.radians(75.0))  # per length of the bone before; cosine to its direction


def flesh_shares(
    count: int,
    joints: NDArray[np.int64] | None,
    weights: NDArray[np.float64] | None,
    rigid: NDArray[np.int64] | None = None,
) -> NDArray[np.float64] | None:
    """Share of the surface's vertices that each of ``count`` joints moves, shape (N,); None without painted weights.

    Args:
        count: Number of joints of the file.
        joints: Influencing joints per vertex, shape (W, K).
        weights: Their weights, shape (W, K).
        rigid: Joint that a vertex follows rigidly, -1 for deformable vertices, shape (W,).
    """
    if joints is None or weights is None or not len(joints):
        return None
    shares = np.zeros(count)
    np.add.at(shares, joints, weights)
    if rigid is not None:
        np.add.at(shares, rigid[rigid >= 0], 1.0)
    return shares / len(joints)


class JointFlesh:
    """Skin ownership in a joint tree.

    Args:
        tree: The file's joints.
        shares: As from :func:`flesh_shares`; None without painted weights: then every joint counts as owning skin.
    """

    def __init__(self, tree: SourceTree, shares: NDArray[np.float64] | None) -> None:
        self._tree = tree
        self.known = shares is not None and bool((shares > _NONE).any())
        """Whether the file has painted weights."""
        self.shares: NDArray[np.float64] = shares if shares is not None and self.known else np.ones(len(tree))
        """Share of the surface that each joint moves, shape (N,); ones without painted weights."""

    @property
    def bare(self) -> NDArray[np.bool_]:
        """Joints that own no skin, shape (N,)."""
        return self.shares <= _NONE

    @cached_property
    def live(self) -> NDArray[np.bool_]:
        """Joints that own skin or have a descendant that does, shape (N,)."""
        live = ~self.bare
        for j in np.flatnonzero(live):
            live[self._tree.ancestors(int(j))] = True
        return live

    @cached_property
    def ends(self) -> dict[int, int]:
        """End joint without skin → the last joint with skin, whose bone it ends.

        Of several candidates: one whose name does not extend the joint's (``index_tip``, not ``index_03_helper`` below
        ``index_03``), then one named as an end, with the shortest name (not ``tip_end`` below ``tip``), then the
        furthest along the bone. Sockets to the side and distant targets are excluded.
        """
        tree, out = self._tree, {}
        if not self.known or tree.flat:
            return {}
        for j in np.flatnonzero(~self.bare):
            if not self.live[list(tree.children[j])].any():
                found = [(self._end_score(int(j), c), -c) for c in tree.subtree(int(j))[1:]]
                score, end = max(found, default=((), 0))
                if score:
                    out[-end] = int(j)
        return out

    def _end_score(self, joint: int, end: int) -> tuple[float, ...]:
        """Score of ``end`` as the end of ``joint``'s bone, larger is likelier; empty if it is none."""
        at, above = self._tree.positions, int(self._tree.parents[joint])
        bone = at[end] - at[joint]
        before = at[joint] - at[above] if above >= 0 else bone
        length, usual = float(np.linalg.norm(bone)), float(np.linalg.norm(before))
        meaning = read_name(self._tree.names[end])
        if length <= _COINCIDENT * usual or length == 0.0 or meaning.kind == "helper":
            return ()
        derived = re.match(re.escape(self._tree.names[joint]) + r"(?![a-z0-9])", self._tree.names[end])
        named = meaning.rank == 4 or (meaning.kind or "").endswith(" end")
        straight = float(unit(bone) @ unit(before)) if usual > 0 else 1.0
        if not named and (length > _LONGEST_END * usual or straight < _MOST_TURNED):
            return ()
        return float(derived is None), float(named), -float(named) * len(self._tree.names[end]), straight * length

    @cached_property
    def dead(self) -> NDArray[np.bool_]:
        """Joints that neither own skin, nor have descendants that do, nor end a bone, shape (N,).

        None in a flat file or without painted weights.
        """
        if not self.known or self._tree.flat:
            return np.zeros(len(self._tree), dtype=bool)
        dead = ~self.live
        dead[list(self.ends)] = False
        return dead

    @cached_property
    def passing(self) -> NDArray[np.bool_]:
        """Joints without skin that have exactly one child with skin at or below it, shape (N,)."""
        if not self.known or self._tree.flat:
            return np.zeros(len(self._tree), dtype=bool)
        lines = np.array([sum(bool(self.live[c]) for c in kids) == 1 for kids in self._tree.children])
        return self.bare & lines

    def on_the_way(self, joint: int) -> bool:
        """Whether a passing joint coincides with a neighbour or lies on the line between its neighbours."""
        tree = self._tree
        above = int(tree.parents[joint])
        below = next(c for c in tree.children[joint] if self.live[c])
        at = tree.positions
        if above < 0:
            return False
        whole = float(np.linalg.norm(at[below] - at[above]))
        parts = float(np.linalg.norm(at[joint] - at[above]) + np.linalg.norm(at[below] - at[joint]))
        near = min(np.linalg.norm(at[joint] - at[above]), np.linalg.norm(at[below] - at[joint]))
        return bool(parts <= 1.01 * whole or near <= 0.02 * parts)


_MOVES_SKIN = ("hip", "knee", "shoulder", "elbow", "knuckle2", "knuckle3")


def without_flesh(
    tree: SourceTree, names: Sequence[str], sources: Sequence[int], owner: NDArray[np.int64], flesh: JointFlesh
) -> list[str]:
    """Warnings about recognised joints that own no skin in the file, including joints merged into them.

    Args:
        tree: The file's joints.
        names: Canonical joints.
        sources: Joint of the file for each canonical joint, -1 for added ones.
        owner: Canonical joint of every joint of the file, shape (N,).
        flesh: Skin ownership in the file.
    """
    if not flesh.known:
        return []
    owned = np.bincount(owner, weights=flesh.shares, minlength=len(names))
    return [
        f"{name}: '{tree.names[sources[j]]}' moves no skin in the file; if another joint is meant, state it with "
        f"{BY_MAP}"
        for j, name in enumerate(names)
        if name.rpartition(".")[2] in _MOVES_SKIN and ".toe" not in name and sources[j] >= 0 and owned[j] <= _NONE
    ]
