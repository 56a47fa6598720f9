"""The joints of an FBX file and their rest pose, the pose in which its meshes were bound.

The file often displays another pose, such as a frame of an animation. Clusters give the transforms of their joints at
bind time; joints without a cluster are placed relative to one that has one, by the bind pose, or else as displayed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.fbx.scene import FbxScene
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["FbxSkeleton", "find_skeleton"]

_SAME = 1e-4
"""Largest difference of transforms that count as equal, per size of the skeleton."""
_SINGULAR = 1e-12  # determinant, per size cubed, up to which a matrix is singular
_SCALED = 1e-3  # deviation of a scale from 1 that is ignored


@dataclass(frozen=True, eq=False)
class FbxSkeleton:
    """The J joints of a file.

    Attributes:
        nodes: Their nodes, shape (J,).
        tree: The joints at rest, with orthonormal axes.
        binds: Joint-to-world transforms at rest as in the file [m], with scale, shape (J, 4, 4).
        squared: Orthonormalisation: ``tree.frames = binds @ squared``, shape (J, 4, 4).
        notes: Irregularities, for the user.
    """

    nodes: NDArray[np.int64]
    tree: SourceTree
    binds: NDArray[np.float64]
    squared: NDArray[np.float64]
    notes: tuple[str, ...]


def find_skeleton(scene: FbxScene) -> FbxSkeleton:
    """The joints: nodes that meshes are bound to and related bones; in files without a skin, all bones.

    Raises:
        InputError: There is no joint.
    """
    bound = _bound(scene)
    nodes = _ordered(scene, _joints(scene, set(bound)))
    if not nodes:
        raise InputError("has no joints: no skin, and no bones", path=scene.path)
    number = {node: j for j, node in enumerate(nodes)}
    parents = np.array([number.get(_above(scene, node, number), -1) for node in nodes])
    if not bound:
        bound = {n: scene.pose[n] for n in nodes if np.isfinite(scene.pose[n]).all() and _regular(scene.pose[n])}
    notes: list[str] = []
    known = _as_shown({node: bind for node, bind in bound.items() if node in number}, scene, notes)
    binds = _rest(scene, nodes, parents, known)
    squared = _squared(binds)
    tree = SourceTree(tuple(scene.names[n] for n in nodes), parents, binds @ squared)
    return FbxSkeleton(np.array(nodes), tree, binds, squared, tuple(notes))


def _bound(scene: FbxScene) -> dict[int, NDArray[np.float64]]:
    """Bind transform of every node with a cluster; that of the first mesh counts."""
    out: dict[int, NDArray[np.float64]] = {}
    for mesh in scene.meshes:
        for node, bind in zip(mesh.skin.nodes, mesh.skin.binds, strict=True) if mesh.skin is not None else ():
            if _regular(bind):
                out.setdefault(int(node), bind)
    return out


def _joints(scene: FbxScene, bound: set[int]) -> set[int]:
    bones = {n for n, kind in enumerate(scene.kinds) if kind == "bone"}
    joints = bones | bound
    if bound:
        wanted = {_top(scene, n, joints) for n in bound}
        joints = {n for n in joints if _top(scene, n, joints) in wanted}
    elif len(bones) < 2:
        return {n for n, kind in enumerate(scene.kinds) if kind in ("bone", "null", "mesh") and scene.parents[n] >= 0}
    joints -= _leaves(scene, joints, bound)
    # a plain node at which several chains branch belongs to the skeleton if it is named so, such as "hips"
    carrying = np.zeros(len(scene.names), dtype=np.int64)
    below = np.isin(np.arange(len(scene.names)), list(joints))
    for n in range(len(scene.names) - 1, 0, -1):  # parents come first
        if below[n] and scene.parents[n] >= 0:
            below[scene.parents[n]] = True
            carrying[scene.parents[n]] += 1
    forks = [int(n) for n in np.flatnonzero(carrying > 1) if scene.kinds[n] == "null" and scene.parents[n] >= 0]
    return joints | {n for n in forks if read_name(scene.names[n]).kind not in (None, "root")}


def _leaves(scene: FbxScene, joints: set[int], bound: set[int]) -> set[int]:
    """Bones that Blender's exporter adds at the ends of chains to store the length of the last bone."""
    ends = joints - bound - {int(parent) for parent in scene.parents}
    return {n for n in ends if scene.names[n] == f"{scene.names[scene.parents[n]]}_end"}


def _ordered(scene: FbxScene, joints: set[int]) -> list[int]:
    """Joints in depth-first order."""
    children: list[list[int]] = [[] for _ in scene.names]
    for n, parent in enumerate(scene.parents):
        if parent >= 0:
            children[parent].append(n)
    out, stack = [], [n for n in reversed(range(len(scene.names))) if scene.parents[n] < 0]
    while stack:
        node = stack.pop()
        if node in joints:
            out.append(node)
        stack.extend(reversed(children[node]))
    return out


def _above(scene: FbxScene, node: int, joints: dict[int, int]) -> int:
    """Nearest ancestor that is a joint, -1 for none."""
    above = int(scene.parents[node])
    while above >= 0 and above not in joints:
        above = int(scene.parents[above])
    return above


def _top(scene: FbxScene, node: int, joints: set[int]) -> int:
    """Topmost joint among a node and its ancestors."""
    top = node
    while node >= 0:
        top = node if node in joints else top
        node = int(scene.parents[node])
    return top


def _as_shown(
    bound: dict[int, NDArray[np.float64]], scene: FbxScene, notes: list[str]
) -> dict[int, NDArray[np.float64]]:
    """Bind transforms, at the place and scale at which the scene displays the skeleton."""
    if not bound:
        return bound
    nodes = list(bound)
    binds, shown = np.array([bound[n] for n in nodes]), scene.shown[nodes]
    moved = shown @ np.linalg.inv(binds)
    size = float(np.linalg.norm(np.ptp(shown[:, :3, 3], axis=0))) or 1.0
    if np.abs(moved[0] @ binds - shown)[:, :3, 3].max() <= _SAME * size and _same_turn(moved):
        return dict(zip(nodes, shown, strict=True))  # bound in the displayed pose, up to a common transform
    scales = np.cbrt(np.abs(np.linalg.det(moved[:, :3, :3])))
    scale = float(np.median(scales))
    if not abs(scale - 1.0) > _SCALED or np.ptp(scales) > 0.01 * scale:
        return bound
    notes.append(f"the file shows its skeleton at {scale:.6g} times the size it was bound at: the shown size is taken")
    return dict(zip(nodes, np.diag([scale, scale, scale, 1.0]) @ binds, strict=True))


def _same_turn(moved: NDArray[np.float64]) -> bool:
    turn = moved[:, :3, :3]
    return bool(np.abs(turn - turn[0]).max() <= _SAME * np.abs(turn[0]).max())


def _rest(
    scene: FbxScene, nodes: list[int], parents: NDArray[np.int64], known: dict[int, NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Joint-to-world transforms at rest, shape (J, 4, 4): the known ones, and others relative to these."""
    binds = np.zeros((len(nodes), 4, 4))
    done = np.zeros(len(nodes), dtype=bool)
    for j, node in enumerate(nodes):
        if node in known:
            binds[j], done[j] = known[node], True
    for j in reversed(range(len(nodes))):  # ancestors of known joints
        parent = int(parents[j])
        if done[j] and parent >= 0 and not done[parent]:
            binds[parent], done[parent] = binds[j] @ _relation(scene, nodes[j], nodes[parent]), True
    for j, node in enumerate(nodes):
        if not done[j]:
            parent = int(parents[j])
            binds[j] = scene.shown[node] if parent < 0 else binds[parent] @ _relation(scene, nodes[parent], node)
            done[j] = True
    return binds


def _relation(scene: FbxScene, start: int, end: int) -> NDArray[np.float64]:
    """Relative transform of two nodes in the bind pose, or as displayed."""
    for transforms in (scene.pose, scene.shown):
        a, b = transforms[start], transforms[end]
        if np.isfinite(a).all() and np.isfinite(b).all() and _regular(a):
            out: NDArray[np.float64] = np.linalg.inv(a) @ b
            return out
    return np.eye(4)


def _squared(binds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transforms S such that ``binds @ S`` consist of rotations and translations, shape (J, 4, 4)."""
    out = np.tile(np.eye(4), (len(binds), 1, 1))
    for j, bind in enumerate(binds[:, :3, :3]):
        if not _regular(binds[j]):
            continue
        u, _, v = np.linalg.svd(bind)
        turn = u @ v
        out[j, :3, :3] = np.linalg.inv(bind) @ (turn * np.linalg.det(turn))
    return out


def _regular(transform: NDArray[np.float64]) -> bool:
    """Whether a transform is invertible."""
    size = np.abs(transform[:3, :3]).max()
    return bool(abs(np.linalg.det(transform[:3, :3])) > _SINGULAR * size**3)
