"""Reader of UsdSkel animations, sampled at frames.

A skeleton is moved by the SkelAnimation bound to it, or by the one chosen by name. Joints that the animation does not
contain stay at rest; if the skeleton or an ancestor is animated, its joints move with it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.spilled_rows import SpilledRows
from warpjld.geometry.rotations import matrices
from warpjld.io.unique_names import unique_names
from warpjld.limits import check_limit
from warpjld.motion.animations import choose_animation
from warpjld.motion.frame_times import frame_times
from warpjld.motion.joint_animation import JointAnimation, spilled_animation
from warpjld.skeleton.streamed_poses import BLOCK

if TYPE_CHECKING:
    from warpjld.io.usd.skeletons import UsdSkeleton, UsdSkeletons
    from warpjld.io.usd.stage import UsdFile

__all__ = ["read_usd_animation", "usd_animation_names"]

_TINY = 1e-7  # replaces zero scale, which would leave no rotation
_FASTEST = 240.0
"""Largest number of time codes per second at which a time code counts as a frame; with more it is a tick."""


def usd_animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of a stage's SkelAnimations, those bound to its skeletons first.

    Raises:
        InputError: Not a USD file.
        MissingExtraError: OpenUSD is not installed.
    """
    from warpjld.io.usd.skeletons import read_skeletons
    from warpjld.io.usd.stage import open_usd

    with open_usd(path) as file:
        found = read_skeletons(file)
        return tuple(_animations(file, () if found is None else found.skeletons))


def read_usd_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of a USD stage, over the stage's time codes, or those of the animation if the stage states none.

    Args:
        path: A .usd, .usda, .usdc or .usdz file with a skeleton and an animation.
        rate: Frames a second; None for the stage's time codes per second (its frames per second where these are ticks).
        name: Name of the animation, in any case; None for those bound to the skeletons.

    Raises:
        InputError: Not a USD file, no skeleton, no animation or none of that name, or invalid samples.
        MissingExtraError: OpenUSD is not installed.
    """
    from warpjld.io.usd.skeletons import read_skeletons
    from warpjld.io.usd.stage import open_usd

    with open_usd(path) as file:
        found = read_skeletons(file)
        if found is None:
            raise InputError(_no_skeleton(file), path=file.path)
        title, chosen, notes = _chosen(file, found.skeletons, name)
        codes, rate, remarks = _time_codes(file, found.skeletons, chosen, rate)
        warnings = [*remarks, *_shapes(chosen)]
        rows, mirrored = _rows(file, found, chosen, codes)
    notes, nothing = (*notes, *dict.fromkeys(file.notes)), np.zeros((0, len(found.tree), 4, 4))
    head = JointAnimation(found.tree, nothing, rate, title, notes, (*warnings, *mirrored), file.up)
    return spilled_animation(head, rows)


def _rows(
    file: UsdFile, found: UsdSkeletons, chosen: list[Any], codes: NDArray[np.float64]
) -> tuple[SpilledRows, list[str]]:
    """Joint-to-world transforms of all skeletons at time codes, a row of N × 16 numbers each, and warnings."""
    rows = SpilledRows(16 * len(found.tree))
    mirrored: dict[int, str] = {}
    moving = [len(_moves_at(skeleton.prim)) > 1 for skeleton in found.skeletons]
    for start in range(0, len(codes), BLOCK):
        blocks = []
        for k, (skeleton, animation) in enumerate(zip(found.skeletons, chosen, strict=True)):
            at = codes[start : start + BLOCK]
            with np.errstate(invalid="ignore", over="ignore"):
                worlds, first = _worlds(file, skeleton, animation, at, at if moving[k] else codes[:1])
            blocks.append(worlds)
            if first is not None:
                mirrored.setdefault(
                    k,
                    f"joint '{skeleton.tokens[first[1]]}': its scale turns negative at frame {start + first[0]}: "
                    "joints are placed as the file says, but no flesh is mirrored",
                )
        together = np.concatenate(blocks, axis=1)
        if not np.isfinite(together).all():
            frame, joint = np.argwhere(~np.isfinite(together))[0][:2]
            where = f"joint '{found.tree.names[joint]}' is not finite at frame {start + frame}"
            raise InputError(where, path=file.path)
        rows.extend(together.reshape(len(together), -1))
    return rows, [mirrored[k] for k in sorted(mirrored)]


def _no_skeleton(file: UsdFile) -> str:
    from pxr import UsdGeom

    if any(prim.IsA(UsdGeom.PointBased) and UsdGeom.PointBased(prim).GetPointsAttr().GetNumTimeSamples() > 1
           for prim in file.prims()):  # fmt: skip
        return "is a vertex cache, a mesh whose points move: it has no skeleton to move a rig by"
    return "no animation in this file: it has no skeleton"


def _animations(file: UsdFile, skeletons: tuple[UsdSkeleton, ...]) -> dict[str, set[str]]:
    """Paths of the SkelAnimations by name, bound ones first; instances of one prototype share a name."""
    from pxr import UsdSkel

    bound = {str(one.animation.GetPath()) for one in skeletons if one.animation}
    kinds: dict[str, tuple[str, set[str]]] = {}
    prims = [prim for prim in file.prims() if prim.IsA(UsdSkel.Animation)]
    for prim in sorted(prims, key=lambda p: str(p.GetPath()) not in bound):
        path = str(prim.GetPath())
        kind = str(prim.GetPrimInPrototype().GetPath()) if prim.IsInstanceProxy() else path
        kinds.setdefault(kind, (prim.GetName(), set()))[1].add(path)
    names = unique_names([name for name, _ in kinds.values()])
    return dict(zip(names, (paths for _, paths in kinds.values()), strict=True))


def _chosen(
    file: UsdFile, skeletons: tuple[UsdSkeleton, ...], name: str | None
) -> tuple[str, list[Any], tuple[str, ...]]:
    """Title, the SkelAnimation of every skeleton (or None), and notes."""
    animations = _animations(file, skeletons)
    if not animations:
        raise InputError("no animation in this file: its skeleton is not animated", path=file.path)
    bound = [one.animation for one in skeletons]
    played = {title: paths for title, paths in animations.items() if {str(p.GetPath()) for p in bound if p} & paths}
    if name is None and len(played) > 1:
        together = ", ".join(played)
        return together, bound, (f"animations {together}: each moves the skeleton it is bound to",)
    title, notes = choose_animation(name, tuple(animations), file.path)
    if title in played:
        return title, [p if p and str(p.GetPath()) in played[title] else None for p in bound], notes
    prim = file.stage.GetPrimAtPath(sorted(animations[title])[0])
    joints = set(_joints(prim))
    fitting = [prim if joints & set(one.tokens) else None for one in skeletons]
    if not any(fitting):
        raise InputError(f"animation '{title}' moves no joint of its skeleton", path=file.path)
    return title, fitting, (*notes, f"animation '{title}' is bound to no skeleton: its joints are matched by name")


def _joints(animation: Any) -> list[str]:
    from pxr import UsdSkel

    return [str(token) for token in UsdSkel.Animation(animation).GetJointsAttr().Get() or ()]


def _shapes(chosen: list[Any]) -> list[str]:
    from pxr import UsdSkel

    moving = [p for p in chosen if p and UsdSkel.Animation(p).GetBlendShapeWeightsAttr().GetNumTimeSamples() > 1]
    return ["the animation of blend shapes is ignored"] if moving else []


def _time_codes(
    file: UsdFile, skeletons: tuple[UsdSkeleton, ...], chosen: list[Any], rate: float | None
) -> tuple[NDArray[np.float64], float, list[str]]:
    """Time codes of the frames, frames a second, and warnings."""
    stage = file.stage
    per_second = float(stage.GetTimeCodesPerSecond())
    if not 0.0 < per_second < float("inf"):
        raise InputError(f"timeCodesPerSecond: want a rate above 0, got {per_second:g}", path=file.path)
    if rate is None:
        rate = per_second if per_second <= _FASTEST else float(stage.GetFramesPerSecond())
    attributes = [attribute for prim in chosen if prim for attribute in _attributes(prim)]
    moved = [_moves_at(one.prim) for one in skeletons]
    keys = sorted({time for times in ([one.GetTimeSamples() for one in attributes] + moved) for time in times})
    warnings = []
    first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if not (stage.HasAuthoredTimeCodeRange() and first < last):
        first, last = (keys[0], keys[-1]) if keys else (0.0, 0.0)
    elif keys and not (first <= keys[0] and keys[-1] <= last):
        warnings.append(
            f"keys from time code {keys[0]:g} to {keys[-1]:g}, of which the stage plays {first:g} to {last:g}"
        )
    if not np.isfinite([first, last]).all():
        raise InputError(f"time codes: want finite ones, got {first:g} to {last:g}", path=file.path)
    times = frame_times(0.0, (last - first) / per_second, rate)
    check_limit("transforms", len(times) * sum(len(one.tokens) for one in skeletons), path=file.path)
    return first + np.round(times * per_second, 9), rate, warnings  # a held sample must not be missed by rounding


def _attributes(animation: Any) -> list[Any]:
    from pxr import UsdSkel

    schema = UsdSkel.Animation(animation)
    return [schema.GetTranslationsAttr(), schema.GetRotationsAttr(), schema.GetScalesAttr()]


def _moves_at(prim: Any) -> list[float]:
    """Time codes at which the transform of a prim or an ancestor has samples."""
    from pxr import UsdGeom

    times: list[float] = []
    while prim and not prim.IsPseudoRoot():
        if xform := UsdGeom.Xformable(prim):
            times += xform.GetTimeSamples()
        prim = prim.GetParent()
    return times


def _worlds(
    file: UsdFile, skeleton: UsdSkeleton, animation: Any, codes: NDArray[np.float64], placed_at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[int, int] | None]:
    """Joint-to-world transforms of a skeleton, shape (F, J, 4, 4), as ``JointAnimation.worlds`` has them; and the first
    frame and joint whose scale has another sign than at rest."""
    from pxr import UsdGeom

    from warpjld.io.usd.skeletons import concatenated
    from warpjld.io.usd.stage import usd_matrices

    places = np.stack(
        [usd_matrices(UsdGeom.XformCache(t).GetLocalToWorldTransform(skeleton.prim)) for t in placed_at.tolist()]
    )
    local, unmirrored = _locals(file, skeleton, animation, codes)
    worlds = places[:, None] @ concatenated(local, skeleton.parents)
    changed = (unmirrored != local).any(axis=(2, 3))
    if not changed.any():
        return np.asarray(worlds), None
    frame, joint = np.argwhere(changed)[0].tolist()
    worlds[..., :3, :3] = (places[:, None] @ concatenated(unmirrored, skeleton.parents))[..., :3, :3]
    return np.asarray(worlds), (frame, joint)


def _locals(
    file: UsdFile, skeleton: UsdSkeleton, animation: Any, codes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Joint-to-parent transforms, shape (F, J, 4, 4), and the same without mirroring by negative scale."""
    out = np.repeat(skeleton.local_rest[None], len(codes), axis=0)
    if not animation:
        return out, out
    number = {token: j for j, token in enumerate(skeleton.tokens)}
    own = np.array([number.get(token, -1) for token in _joints(animation)], dtype=np.int64)
    known = own >= 0
    rest = skeleton.local_rest[own]
    side = np.where(np.linalg.det(rest[:, :3, :3]) < 0.0, -1.0, 1.0)
    lengths = side[:, None] * np.linalg.norm(rest[:, :3, :3], axis=1)
    still = (lambda: rest[:, :3, 3], lambda: _quaternions(rest[:, :3, :3] / lengths[:, None]), lambda: lengths)
    moves, turns, scales = (
        _samples(file, animation, attribute, codes, (len(own), width), values)
        for attribute, width, values in zip(_attributes(animation), (3, 4, 3), still, strict=True)
    )
    norm = np.linalg.norm(turns, axis=-1)
    if not (norm[:, known] > 0.0).all():
        frame, joint = np.argwhere(~(norm > 0.0) & known)[0]
        raise InputError(
            f"animation '{animation.GetName()}': joint '{_joints(animation)[joint]}' has no rotation at frame {frame}",
            path=file.path,
        )
    linear = matrices(turns[:, known])
    amount = scales[:, known]
    amount = np.where(np.abs(amount) < _TINY, _TINY, amount)[..., None, :]
    out[..., :3, 3][:, own[known]] = moves[:, known]
    unmirrored = out.copy()
    out[..., :3, :3][:, own[known]] = linear * amount
    side = side[known, None, None]
    same = side * np.prod(amount, axis=-1, keepdims=True) >= 0.0
    unmirrored[..., :3, :3][:, own[known]] = linear * np.where(same, amount, side * np.abs(amount))
    return out, unmirrored


def _quaternions(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation  # it takes longer to import than OpenUSD, and is seldom needed

    return np.asarray(Rotation.from_matrix(turns).as_quat())


def _samples(
    file: UsdFile,
    animation: Any,
    attribute: Any,
    codes: NDArray[np.float64],
    shape: tuple[int, int],
    still: Callable[[], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """Values of an attribute at time codes, shape (F, J, 3) or (F, J, 4); ``still()`` if it has none."""
    at = codes.tolist() if attribute.ValueMightBeTimeVarying() else codes[:1].tolist()
    values = []
    for code in at:
        value = attribute.Get(code)
        array = still() if value is None else np.array(value, dtype=np.float64)
        if array.shape != shape:
            raise InputError(
                f"animation '{animation.GetName()}': want {shape[0]} {attribute.GetName()}, one for each of its "
                f"joints, got {len(array)}",
                path=file.path,
            )
        values.append(array)
    return np.repeat(np.stack(values), len(codes) // len(at), axis=0)
