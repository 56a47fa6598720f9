"""UsdSkel skeletons of a stage as one joint tree, the same for rigs and animations.

Only skeletons that skin a mesh are used, unless none does. USD names joints by their path in the skeleton
(``Hips/Spine/Neck``): a joint's name is the last element, prefixed by its ancestors' if that is not unique, unless the
skeleton has ``jointNames``.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.usd.stage import UsdFile, usd_matrices
from warpjld.limits import check_limit
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["UsdSkeleton", "UsdSkeletons", "concatenated", "read_skeletons"]

_SAME = 1e-4
"""Largest difference of transforms that count as equal, per size of the skeleton."""


@dataclass(frozen=True, eq=False)
class UsdSkeleton:
    """A skeleton of J joints of a stage.

    Attributes:
        prim: Its prim.
        tokens: USD's joint tokens: their paths.
        parents: Parent of every joint, -1 for none, shape (J,).
        bind: Bind transforms of the joints, in the space of ``to_world``, shape (J, 4, 4).
        local_rest: Joint-to-parent transforms of joints that are not animated, shape (J, 4, 4).
        to_world: Transform of ``bind`` and bound vertices to the stage's world, shape (4, 4).
        first: Index of its first joint in the whole tree.
        meshes: ``UsdSkel.SkinningQuery`` of every mesh it skins.
    """

    prim: Any
    tokens: tuple[str, ...]
    parents: NDArray[np.int64]
    bind: NDArray[np.float64]
    local_rest: NDArray[np.float64]
    to_world: NDArray[np.float64]
    first: int
    meshes: tuple[Any, ...]

    @property
    def path(self) -> str:
        """Its prim's path."""
        return str(self.prim.GetPath())

    @property
    def animation(self) -> Any:
        """The ``SkelAnimation`` prim bound to it, an invalid prim if there is none."""
        from pxr import UsdSkel

        return UsdSkel.BindingAPI(self.prim).GetInheritedAnimationSource()

    @property
    def frames(self) -> NDArray[np.float64]:
        """Joint-to-world transforms at rest, shape (J, 4, 4)."""
        return self.to_world @ self.bind


@dataclass(frozen=True, eq=False)
class UsdSkeletons:
    """The skeletons of a stage, and all their joints as one tree."""

    tree: SourceTree
    skeletons: tuple[UsdSkeleton, ...]


def read_skeletons(file: UsdFile) -> UsdSkeletons | None:
    """The stage's skeletons; None if there are none.

    Raises:
        InputError: A skeleton without joints, or without transforms for them.
    """
    found = _bindings(file)
    if any(meshes for _, meshes in found):
        found = [one for one in found if one[1]]
    skeletons: list[UsdSkeleton] = []
    for prim, meshes in found:
        first = skeletons[-1].first + len(skeletons[-1].tokens) if skeletons else 0
        skeletons.append(_skeleton(file, prim, tuple(meshes), first))
        check_limit("joints", first + len(skeletons[-1].tokens), path=file.path)
    if not skeletons:
        return None
    parents = [np.where(one.parents < 0, -1, one.parents + one.first) for one in skeletons]
    frames = np.concatenate([one.frames for one in skeletons])
    tree = SourceTree(tuple(_names(skeletons)), np.concatenate(parents), frames)
    return UsdSkeletons(tree, tuple(skeletons))


def _bindings(file: UsdFile) -> list[tuple[Any, list[Any]]]:
    """Every skeleton's prim and the skinning queries of its meshes, in the stage's order."""
    from pxr import Usd, UsdSkel

    cache = UsdSkel.Cache()
    prims = file.prims()
    found: dict[str, tuple[Any, list[Any]]] = {
        str(prim.GetPath()): (prim, []) for prim in prims if prim.IsA(UsdSkel.Skeleton)
    }
    seen: set[str] = set()
    for prim in prims:
        if not prim.IsA(UsdSkel.Root):
            continue
        root = UsdSkel.Root(prim)
        cache.Populate(root, Usd.TraverseInstanceProxies())
        for binding in cache.ComputeSkelBindings(root, Usd.TraverseInstanceProxies()):
            path = str(binding.GetSkeleton().GetPath())
            for mesh in binding.GetSkinningTargets():
                target = str(mesh.GetPrim().GetPath())
                if path in found and target not in seen:  # SkelRoots may be nested
                    found[path][1].append(mesh)
                seen.add(target)
    return list(found.values())


def _skeleton(file: UsdFile, prim: Any, meshes: tuple[Any, ...], first: int) -> UsdSkeleton:
    from pxr import Usd, UsdGeom, UsdSkel

    path = prim.GetPath()
    skeleton = UsdSkel.Skeleton(prim)
    tokens = tuple(str(token) for token in skeleton.GetJointsAttr().Get() or ())
    if not tokens:
        raise InputError(f"skeleton '{path}' has no joints", path=file.path)
    check_limit("joints", len(tokens), of=f"skeleton '{path}'", path=file.path)
    if len(set(tokens)) != len(tokens):
        twice = next(token for token, count in Counter(tokens).items() if count > 1)
        raise InputError(f"skeleton '{path}' has two joints '{twice}'", path=file.path)
    parents = _parents(tokens)
    bind = usd_matrices(skeleton.GetBindTransformsAttr().Get() or np.zeros((0, 4, 4)))
    local = usd_matrices(skeleton.GetRestTransformsAttr().Get() or np.zeros((0, 4, 4)))
    rest = None
    if len(local) == len(tokens) and _regular(local).all():
        rest = concatenated(local, parents)
    elif len(local):
        file.notes.append(f"skeleton '{path}': its restTransforms are no transforms of its joints: not used")
    if len(bind) != len(tokens):
        if rest is None:
            raise InputError(
                f"skeleton '{path}': {len(tokens)} joints need as many bindTransforms, got {len(bind)}", path=file.path
            )
        file.notes.append(f"skeleton '{path}' has no bindTransforms for its joints: restTransforms are taken")
        bind = rest
    to_world = usd_matrices(UsdGeom.XformCache(Usd.TimeCode.EarliestTime()).GetLocalToWorldTransform(prim))
    if rest is not None and _is_placed(bind, rest, to_world):  # in world space, as USD's documentation says
        to_world = np.eye(4)
    with np.errstate(invalid="ignore"):
        regular = _regular(np.asarray(to_world @ bind))
    if not regular.all():
        name = tokens[regular.tolist().index(False)]
        raise InputError(
            f"skeleton '{path}': the bind transform of joint '{name}' is not finite, or flattens space (scale 0)",
            path=file.path,
        )
    if rest is None:
        local = np.where(parents.reshape(-1, 1, 1) < 0, bind, np.linalg.inv(bind[parents]) @ bind)
    return UsdSkeleton(prim, tokens, parents, bind, local, to_world, first, meshes)


def _regular(transforms: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask of transforms (J, 4, 4) that are finite and invertible."""
    finite = np.asarray(np.isfinite(transforms).all(axis=(1, 2)))
    linear = np.where(finite[:, None, None], transforms, 0.0)[:, :3, :3]
    return np.asarray(np.abs(np.linalg.det(linear)) > 1e-12 * np.linalg.norm(linear, axis=(1, 2)) ** 3)


def _parents(tokens: tuple[str, ...]) -> NDArray[np.int64]:
    """Nearest ancestor in each joint's path, -1 for none, as ``UsdSkel.Topology`` but for names it rejects, too."""
    number = {token: j for j, token in enumerate(tokens)}
    out = np.full(len(tokens), -1, dtype=np.int64)
    for j, token in enumerate(tokens):
        above = token
        while out[j] < 0 and "/" in above:
            above = above.rpartition("/")[0]
            out[j] = number.get(above, -1)
    return out


def concatenated(local: NDArray[np.float64], parents: NDArray[np.int64]) -> NDArray[np.float64]:
    """Joint-to-skeleton transforms from joint-to-parent ones, shape (…, J, 4, 4), joints in any order."""
    out = local.copy()
    done = parents < 0
    while not done.all():
        ready = np.flatnonzero(~done & done[parents])
        out[..., ready, :, :] = out[..., parents[ready], :, :] @ local[..., ready, :, :]
        done[ready] = True
    return out


def _is_placed(bind: NDArray[np.float64], rest: NDArray[np.float64], to_world: NDArray[np.float64]) -> bool:
    """Whether bind transforms include the skeleton's own transform to the world."""
    size = float(np.ptp(bind[:, :3, 3], axis=0).max()) or 1.0
    scale = np.array([[1.0, 1.0, 1.0, size]] * 3)

    def close(other: NDArray[np.float64]) -> bool:
        return bool((np.abs(bind - other)[:, :3] <= _SAME * scale).all())

    return close(to_world @ rest) and not close(rest)


def _names(skeletons: list[UsdSkeleton]) -> list[str]:
    own = [_own_names(one) for one in skeletons]
    if len(set().union(*own)) == sum(map(len, own)):
        return [name for names in own for name in names]
    paths = [one.path.strip("/").split("/") for one in skeletons]
    while len({path[0] for path in paths}) == 1 and min(map(len, paths)) > 1:
        paths = [path[1:] for path in paths]
    while len({path[-1] for path in paths}) == 1 and min(map(len, paths)) > 1:
        paths = [path[:-1] for path in paths]
    return ["/".join([*path, name]) for path, names in zip(paths, own, strict=True) for name in names]


def _own_names(skeleton: UsdSkeleton) -> list[str]:
    """``jointNames`` if complete and unique (they may contain characters that USD's paths cannot), else from paths."""
    from pxr import UsdSkel

    given = [str(name) for name in UsdSkel.Skeleton(skeleton.prim).GetJointNamesAttr().Get() or ()]
    if len(given) == len(skeleton.tokens) == len(set(given)) and all(given):
        return given
    return _shortest(skeleton.tokens)


def _shortest(tokens: tuple[str, ...]) -> list[str]:
    """The shortest suffixes of joint paths that are unique in a skeleton."""
    paths = [token.split("/") for token in tokens]
    length = [1] * len(paths)
    while True:
        names = ["/".join(path[-n:]) for path, n in zip(paths, length, strict=True)]
        count = Counter(names)
        longer = [j for j, name in enumerate(names) if count[name] > 1 and length[j] < len(paths[j])]
        if not longer:
            return names
        for j in longer:
            length[j] += 1
