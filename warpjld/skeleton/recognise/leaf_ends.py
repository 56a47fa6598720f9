"""Completion of leaf joints by end joints: a joint without children moves skin beyond it, too (R13).

The covering's segments run from joint to joint. Without an end joint, the flesh beyond the last joint of a tail, an ear
or a toe would follow the segment before it, and the joint's own rotation would be lost.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.digits import is_digit
from warpjld.skeleton.recognise.extremity import find_extremity
from warpjld.skeleton.recognise.layout import Layout
from warpjld.skeleton.recognise.painted import Painted
from warpjld.skeleton.recognise.section import nearby

__all__ = ["add_leaf_ends"]

_IS_END = re.compile(
    r"((left|right)\.)?((thumb|index|middle|ring|pinky|hand|toe\d*)\.tip|heel)|head\.top|chin|nose_tip|sternum"
)
"""Canonical extremities, which end a bone and get no end of their own."""
_OWN = 0.5  # smallest weight at which a vertex counts as owned by a joint
_SMALLEST = 5e-3  # smallest reach of flesh that gets a bone, per size of the skeleton
_ONE_SIDED = 0.2  # smallest distance of the flesh's centroid from the joint, per reach, that gives a direction
_CONTINUES = 0.4  # smallest extent of a surface beyond its last joint, per length of the bone before (without weights)
_SHORTEST, _LONGEST = 0.3, 0.9  # limits of the added bone's length, per reach of the flesh
_FAR, _MUCH = 2.0, 0.15  # distance from all bones, per thickness, and share of such flesh, that call for another bone


def add_leaf_ends(
    layout: Layout,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    painted: Painted | None,
    *,
    branches: bool,
) -> None:
    """Add an end, ``tail3.end`` or ``index.tip``, to every joint without children that owns skin and is no end itself.

    It is placed at the end of the skin that the joint owns; without weights, where the surface ends along the
    direction of the bone before.

    Args:
        layout: The canonical joints; ends are appended.
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        painted: Painted weights; None without.
        branches: Whether joints with children get one too, where a large part of their skin is far from the bones to
            these, as an animal's snout is where only ears are children of the head.
    """
    size = float(np.linalg.norm(np.ptp(layout.positions, axis=0)))
    if painted is not None:
        size = max(size, 0.1 * float(np.linalg.norm(np.ptp(painted.points, axis=0))))
    found: dict[str, str] = {}
    for joint, name in list(enumerate(layout.names)):
        kids = [k for k, parent in enumerate(layout.parents) if parent == joint]
        if _IS_END.fullmatch(name) or (kids and not (branches and painted is not None)):
            continue
        if painted is None:
            end = _end_along_bone(layout, joint, vertices, faces)
        else:
            end = _end_of_skin(layout, joint, kids, vertices, faces, painted, _SMALLEST * size)
        if end is not None:
            # of a digit of a hand that is not whole it is the tip
            last = is_digit(name) and name.endswith(".knuckle3")
            added = f"{name.removesuffix('.knuckle3')}.tip" if last else f"{name}.end"
            while added in layout.names:
                added += "#2"
            layout.add(added, name, end)
            found[added] = name
    if found:
        layout.notes.append(f"ends of bones added in the surface: {', '.join(found)}")


def _end_along_bone(
    layout: Layout, joint: int, vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> NDArray[np.float64] | None:
    parent = layout.parents[joint]
    if parent < 0:
        return None
    start = layout.positions[joint]
    bone = start - layout.positions[parent]
    length = float(np.linalg.norm(bone))
    if not length > 0.0:
        return None
    near = nearby(vertices, faces, start, 4.0 * length)
    end = find_extremity(vertices, near, start, bone / length, length)
    return end if end is not None and np.linalg.norm(end - start) > _CONTINUES * length else None


def _end_of_skin(
    layout: Layout,
    joint: int,
    kids: list[int],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    painted: Painted,
    smallest: float,
) -> NDArray[np.float64] | None:
    """End of the skin that a joint owns; None where it owns none, or its bones cover nearly all of it."""
    share = np.where(layout.owner[painted.joints] == joint, painted.weights, 0.0).sum(axis=1)
    own = share > _OWN
    if own.sum() < 3:
        return None
    start = layout.positions[joint]
    flesh = painted.points[own] - start
    if kids:
        far = _far_from_bones(flesh, [layout.positions[k] - start for k in kids])
        if far.mean() < _MUCH:
            return None
        flesh = flesh[far]
    reach = float(np.quantile(np.linalg.norm(flesh, axis=1), 0.98))
    if reach < smallest:
        return None
    direction = _direction(layout, joint, flesh, reach)
    along = flesh @ direction
    beyond = float(along.max())
    if beyond < smallest:
        return None
    near = nearby(vertices, faces, start, 2.0 * reach)
    end = find_extremity(vertices, near, start, direction, beyond)
    if end is not None:
        # the surface that the line meets may belong to another part, or be a fold
        length = float((end - start) @ direction)
        if _SHORTEST * beyond <= length <= beyond and np.linalg.norm(end - start) < 1.2 * length:
            return end
    return start + _far_centre(flesh, direction, beyond)


def _far_from_bones(flesh: NDArray[np.float64], bones: list[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Mask of flesh, relative to its joint, that is nearly as far from the joint's bones as from the joint itself."""
    away = np.full(len(flesh), np.inf)
    for bone in bones:
        along = np.clip(flesh @ bone / max(float(bone @ bone), 1e-30), 0.0, 1.0)
        away = np.minimum(away, np.linalg.norm(flesh - along[:, None] * bone, axis=1))
    thickness = float(np.quantile(away, 0.25))
    return np.asarray((away > _FAR * thickness) & (away > 0.8 * np.linalg.norm(flesh, axis=1)))


def _direction(layout: Layout, joint: int, flesh: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
    """Unit direction of a joint's flesh: of its centroid, or else of the bone before, or its principal axis."""
    centre = flesh.mean(axis=0)
    if np.linalg.norm(centre) > _ONE_SIDED * reach:
        return unit(centre)
    parent = layout.parents[joint]
    bone = layout.positions[joint] - layout.positions[parent] if parent >= 0 else np.zeros(3)
    if np.linalg.norm(bone) > 1e-6 * reach:
        return unit(bone)
    longest = np.linalg.svd(flesh - centre, full_matrices=False)[2][0]
    return np.asarray(longest if (flesh @ longest).max() >= -(flesh @ longest).min() else -longest)


def _far_centre(flesh: NDArray[np.float64], direction: NDArray[np.float64], beyond: float) -> NDArray[np.float64]:
    """Centre of the flesh near its far end, relative to the joint, one radius before the end or at least half-way."""
    along = flesh @ direction
    last = flesh[along > 0.6 * beyond]
    aside = last - np.outer(last @ direction, direction)
    centre = aside.mean(axis=0)
    radius = float(np.median(np.linalg.norm(aside - centre, axis=1)))
    return np.asarray(np.clip(beyond - radius, 0.5 * beyond, _LONGEST * beyond) * direction + centre)
