"""Proposal of a body's 87 points from its surface alone.

Crotch, armpits, narrowest section of the neck and wrists are measured; other joints are placed at average proportions
(Drillis, Contini 1966: shares of the height), in the middle of the cross-section.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.actor import face_points
from warpjld.skeleton.actor_points import ACTOR_POINTS
from warpjld.skeleton.place.branches import centre_line, find_branches
from warpjld.skeleton.place.hand import place_hand
from warpjld.skeleton.place.solid import VoxelSolid, solid_of
from warpjld.skeleton.place.stance import find_stance, pieces

__all__ = ["place_body"]

Array = NDArray[np.float64]
Points = dict[str, Array]

_GRID = 170  # voxels in a body's height
_HAND_GRID = 110  # voxels in a hand's length
# heights and lengths below are shares of the body's height unless stated
_CROTCH = (0.40, 0.55)  # range of heights that is searched for the crotch
_USUAL_CROTCH = 0.47  # where none is found
_HIP = 0.055  # hip joint above the crotch
_ANKLE = 0.043  # ankle above the soles
_KNEE = 0.5  # share of the way from ankle to hip
_SPINE = (0.14, 0.28, 0.45, 0.72)  # vertebrae: shares of the way from the pelvis to the lowest vertebra of the neck
_SPINE_DEPTH, _SKULL_DEPTH = 0.42, 0.3  # share of the trunk's depth from the back; the mouth lies before the skull base
_WAIST = (0.56, 0.76)  # range of heights at which the trunk's depth is measured
_LEAN = 1.15
"""Depth of the trunk that counts for spine and hips, per its least depth there: without a belly, breasts or folds of
clothes, depths from waist to chest differ by an eighth."""
_HIPS = 1.3  # likewise at the hips, with the buttocks
_NECK = (0.80, 0.92)  # range of heights that is searched for the narrowest section of the neck
_ELBOW = 0.48  # share of the way from wrist to shoulder
_SHOULDER = 0.1  # head of the humerus from the midline
_ARM_WIDENING = 1.35  # an arm ends where its width exceeds its median width by this factor
_REACH = 1.4  # part of an arm that is taken as its hand, per distance from fingertip to wrist
_BALL = 0.72  # share of the foot's length from the heel
_HEEL = 0.13  # share of the foot's length from its back end


def place_body(vertices: Array, faces: NDArray[np.integer], label: str = "the body") -> Points:
    """Propose a body's points.

    Args:
        vertices: Its surface in any unit and axes, shape (V, 3).
        faces: Its triangles, shape (T, 3).
        label: Name of the surface in messages.

    Returns:
        The 87 points in the surface's own unit and axes.

    Raises:
        InputError: It is not an upright body with legs, arms and fingers apart.
    """
    solid = solid_of(vertices, faces, float(np.ptp(vertices, axis=0).max()) / _GRID).main_piece()
    stance = find_stance(solid, label)
    solid = VoxelSolid(
        stance.inward(solid.points), solid.depth / stance.height, solid.size / stance.height, solid.graph
    )
    # path lengths are in the solid's unit, too
    solid.graph.data /= stance.height
    points: Points = {}
    legs = _legs(solid, points, label)
    _trunk(solid, points)
    surface = stance.inward(vertices)
    _head(solid, surface, points)
    for side, tip in zip(("left", "right"), _hands(solid, points, legs, label), strict=True):
        _arm(solid, surface, faces, side, tip, points, f"{label}, {side} hand")
    nearest = {name: solid.nearest(place) for name, place in points.items()}
    for name, voxel in nearest.items():  # centres of concave sections may lie outside the solid
        if "." in name and name.split(".", 1)[1].partition(".")[0] in _DIGITS:
            continue
        if np.linalg.norm(solid.points[voxel] - points[name]) > 1.5 * solid.size:
            points[name] = solid.points[voxel]
    return {name: stance.outward(points[name]) for name in ACTOR_POINTS}


_DIGITS = ("thumb", "index", "middle", "ring", "pinky")


def _slab(solid: VoxelSolid, height: float) -> NDArray[np.bool_]:
    return np.asarray(np.abs(solid.points[:, 1] - height) < 1.2 * solid.size)


def _leg_section(solid: VoxelSolid, height: float, sign: float, place: float | None = None) -> NDArray[np.int64]:
    """Voxels of the leg on one side at a height."""
    found = [p for p in pieces(solid, _slab(solid, height)) if sign * solid.points[p, 0].mean() > 0 and len(p) > 8]
    if not found:
        return np.zeros(0, dtype=np.int64)
    # of several pieces (a hand may hang beside the leg), the one nearest to ``place``
    large = [p for p in found if len(p) > 0.4 * len(found[0])]
    return min(large, key=lambda p: abs(float(solid.points[p, 0].mean()) - (place or 0.0)))


def _crotch(solid: VoxelSolid) -> float:
    """Height of the crotch: the lowest height at which one piece of the section spans the midline."""
    for height in np.arange(*_CROTCH, 1.5 * solid.size):
        for piece in pieces(solid, _slab(solid, float(height)))[:3]:
            x = solid.points[piece, 0]
            if x.min() < -0.02 and x.max() > 0.02 and abs(x.mean()) < 0.02:
                return float(height) if height > _CROTCH[0] + solid.size else _USUAL_CROTCH
    return _USUAL_CROTCH


def _legs(solid: VoxelSolid, points: Points, label: str) -> NDArray[np.bool_]:
    """Place the joints from hips to toes; returns the mask of the legs' voxels."""
    crotch = _crotch(solid)
    high = crotch + _HIP
    legs = solid.points[:, 1] < crotch
    section = solid.points[_slab(solid, high) & (np.abs(solid.points[:, 0]) < 0.12)]
    middle = section[section[:, 2] < section[:, 2].min() + _HIPS * _lean_depth(solid)].mean(axis=0)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        thigh = solid.points[_leg_section(solid, crotch - 3.0 * solid.size, sign)].mean(axis=0)
        hip = np.array([thigh[0], high, (thigh[2] + middle[2]) / 2])
        sole = _sole(solid, legs, sign)
        sections = [_leg_section(solid, sole + y, sign) for y in (0.075, 0.14)]
        if not all(len(one) for one in sections):
            raise InputError(f"{label}: no {side} leg stands apart from the other down to its ankle")
        shin = [solid.points[one].mean(axis=0) for one in sections]
        ankle = shin[0] + (shin[0] - shin[1]) * (0.075 - _ANKLE) / 0.065
        knee_height = ankle[1] + _KNEE * (hip[1] - ankle[1])
        points[f"{side}.femoral_head"] = hip
        points[f"{side}.knee"] = solid.points[_leg_section(solid, knee_height, sign)].mean(axis=0)
        points[f"{side}.ankle"] = ankle
        _foot(solid, side, sign, sole, points)
    hips = (points["left.femoral_head"] + points["right.femoral_head"]) / 2
    points["pelvis"] = np.array([0.0, hips[1] + 0.01, middle[2]])
    for side in ("left", "right"):
        points[f"{side}.pelvic_hip"] = (points["pelvis"] + points[f"{side}.femoral_head"]) / 2
    return legs


def _sole(solid: VoxelSolid, legs: NDArray[np.bool_], sign: float) -> float:
    """Height of a foot above the other: 0 for the lower one, or for both of who stands on both."""
    own = legs & (sign * solid.points[:, 0] > 0)
    return float(solid.points[own, 1].min() - solid.points[legs, 1].min()) if own.any() else 0.0


def _foot(solid: VoxelSolid, side: str, sign: float, sole: float, points: Points) -> None:
    ankle = points[f"{side}.ankle"]
    foot = solid.points[(solid.points[:, 1] < sole + _ANKLE + 0.01) & (sign * solid.points[:, 0] > 0)]
    foot = foot[np.linalg.norm((foot - ankle)[:, [0, 2]], axis=1) < 0.2]
    ahead = foot[foot[:, 2] > np.quantile(foot[:, 2], 0.9)].mean(axis=0) - ankle
    forward = unit(np.array([ahead[0], 0.0, ahead[2]]))
    outward = np.cross((0.0, 1.0, 0.0), forward) * sign
    along, across = (foot - ankle) @ forward, (foot - ankle) @ outward
    back, length = float(along.min()), float(np.ptp(along))

    def slice_at(share: float) -> Array:
        near = np.abs(along - (back + share * length)) < 1.2 * solid.size
        return np.asarray(foot[near].mean(axis=0))

    points[f"{side}.heel"] = slice_at(_HEEL)
    points[f"{side}.ball"] = slice_at(_BALL)
    front = along > back + 0.8 * length
    low, width = float(across[front].min()), float(np.ptp(across[front]))
    for name, share in (("big", 0.22), ("middle", 0.52), ("little", 0.85)):
        strip = (np.abs(across - (low + share * width)) < 0.13 * width + 0.5 * solid.size) & (
            along > back + 0.5 * length
        )
        end = float(along[strip].max())
        column = strip & (along > end - 3.0 * solid.size)
        points[f"{side}.{name}_toe_tip"] = foot[column].mean(axis=0)


def _trunk(solid: VoxelSolid, points: Points) -> None:
    """Spine, neck and sternum."""
    pelvis = points["pelvis"]
    heights = np.arange(*_NECK, 1.5 * solid.size)
    widths = [float((_slab(solid, y) & (np.abs(solid.points[:, 0]) < 0.12)).sum()) for y in heights]
    # slabs contain a varying number of voxel layers: count per layer
    widths = [
        w / max(1, len(np.unique(np.round(solid.points[_slab(solid, y), 1] / solid.size))))
        for w, y in zip(widths, heights, strict=True)
    ]
    neck = float(heights[int(np.argmin(widths))])
    lowest, base = neck - 0.02, neck + 0.035
    spine = {"vertebra5": lowest, "skull_base": base}
    spine |= {f"vertebra{k}": pelvis[1] + s * (lowest - pelvis[1]) for k, s in enumerate(_SPINE, start=1)}
    lean = _lean_depth(solid)
    for name, height in spine.items():
        back, front = _depths(solid, height)
        share = _SKULL_DEPTH if name == "skull_base" else _SPINE_DEPTH
        points[name] = np.array([0.0, height, back + share * min(front - back, lean)])
    height = lowest - 0.035
    back, front = _depths(solid, height)
    points["sternum"] = np.array([0.0, height, back + 0.75 * (front - back)])
    for side, sign in (("left", 1.0), ("right", -1.0)):
        points[f"{side}.clavicle"] = points["sternum"] + np.array([sign * 0.014, 0.0, 0.0])


def _depths(solid: VoxelSolid, height: float) -> tuple[float, float]:
    """Back and front of the trunk on its midline."""
    z = solid.points[_slab(solid, height) & (np.abs(solid.points[:, 0]) < 0.02), 2]
    return (float(z.min()), float(z.max())) if len(z) else (0.0, 0.0)


def _lean_depth(solid: VoxelSolid) -> float:
    """Largest depth of the trunk that counts, so that what bulges in front does not move the spine."""
    depths = [front - back for back, front in (_depths(solid, float(y)) for y in np.linspace(*_WAIST, 9))]
    return _LEAN * min(depths)


def _head(solid: VoxelSolid, surface: Array, points: Points) -> None:
    base = points["skull_base"]
    skull = (solid.points[:, 1] > base[1]) & (solid.points[:, 1] < 1.0 + solid.size)
    skull &= np.abs(solid.points[:, 0]) < 0.09
    crown = float(solid.points[skull, 1].max())
    radius = min(float(solid.depth[skull].max()), 0.6 * (crown - base[1]))
    top = solid.points[skull & (np.abs(solid.points[:, 1] - (crown - radius)) < 1.2 * solid.size)].mean(axis=0)
    points["head_top"] = top * (0.0, 1.0, 1.0)
    joints = {"head": base, "head.top": np.array([base[0], crown, base[2]])}
    up, forward = np.eye(3)[1], np.eye(3)[2]
    found = dict(face_points(joints, surface[surface[:, 1] > points["sternum"][1]], up, forward))
    reach = {"nose_tip": 0.38, "chin": 0.0}
    for name, share in reach.items():
        place = found.get(name)
        if place is None:
            place = np.array([0.0, base[1] + share * (crown - base[1]) - 0.02, _depths(solid, base[1])[1]])
        points[name] = place * (0.0, 1.0, 1.0) - 0.012 * forward


def _hands(solid: VoxelSolid, points: Points, legs: NDArray[np.bool_], label: str) -> list[int]:
    """The furthest voxel of the left and of the right arm."""
    distance = solid.distances(solid.nearest(points["pelvis"]))
    ends = [b for b in find_branches(solid, distance, 0.12) if abs(solid.points[b.tip, 0]) > 0.06]
    feet = [(points[f"{side}.ball"]) for side in ("left", "right")]
    ends = [b for b in ends if min(np.linalg.norm(solid.points[b.tip] - f) for f in feet) > 0.12]
    out = []
    for sign in (1.0, -1.0):
        own = [b for b in ends if sign * solid.points[b.tip, 0] > 0]
        if not own:
            raise InputError(f"{label}: no {'left' if sign > 0 else 'right'} arm stands apart from trunk and legs")
        out.append(max(own, key=lambda b: float(distance[b.tip])).tip)
    return out


def _arm(
    solid: VoxelSolid, surface: Array, faces: NDArray[np.integer], side: str, tip: int, points: Points, label: str
) -> None:
    from_tip = solid.distances(tip)
    step = 2.0 * solid.size
    line, areas = centre_line(solid, np.flatnonzero(np.isfinite(from_tip)), from_tip, step)
    widths = np.sqrt(areas)
    at = (np.arange(len(widths)) + 0.5) * step
    usual = float(np.median(widths[(at > 0.26) & (at < 0.34)]))
    wide = np.flatnonzero((at > 0.25) & (widths > _ARM_WIDENING * usual))
    # the arm's section widens at the armpit; the shoulder joint is at a fixed distance from the midline
    beside = np.flatnonzero((at > 0.25) & (np.abs(line[:, 0]) < _SHOULDER))
    ends = [float(at[found[0]]) for found in (wide, beside) if len(found)]
    end = float(np.mean(ends)) if ends else 0.39
    near = (at > 0.2 * end) & (at < 0.38 * end)
    wrist = float(at[near][int(np.argmin(widths[near]))])
    place = dict(zip(("wrist", "elbow", "shoulder"), (wrist, wrist + _ELBOW * (end - wrist), end), strict=True))
    there = {name: np.stack([np.interp(s, at, line[:, k]) for k in range(3)]) for name, s in place.items()}
    hand = place_hand(*_fine_hand(solid, surface, faces, line, from_tip, wrist), label)
    points |= {f"{side}.{name}": point for name, point in hand.items()}
    points[f"{side}.elbow"], points[f"{side}.shoulder"] = there["elbow"], there["shoulder"]
    middle = (place["wrist"] + place["elbow"]) / 2
    points[f"{side}.forearm_twist"] = np.stack([np.interp(middle, at, line[:, k]) for k in range(3)])


def _fine_hand(
    solid: VoxelSolid, surface: Array, faces: NDArray[np.integer], line: Array, from_tip: Array, wrist: float
) -> tuple[VoxelSolid, Array]:
    """A hand with part of the forearm as a solid of finer voxels, and a point at the forearm's end."""
    own = solid.points[from_tip < _REACH * wrist]
    low, high = own.min(axis=0) - 2.0 * solid.size, own.max(axis=0) + 2.0 * solid.size
    fine = solid_of(surface, faces, wrist / _HAND_GRID, low=low, high=high, within=solid)
    # other parts in the box, as the rest of the arm or a thigh, are left out
    _, nearest = cKDTree(solid.points).query(fine.points)
    fine = fine.part(from_tip[nearest] < _REACH * wrist).main_piece()
    step = 2.0 * solid.size
    return fine, line[min(int((_REACH - 0.12) * wrist / step), len(line) - 1)]
