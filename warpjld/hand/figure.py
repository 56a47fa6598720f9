"""The built-in body: an actor's 87 points in average proportions, and a smooth surface around them (R12, R17).

Measures are relative to the body's height (Drillis, Contini 1966), hands as in :mod:`warpjld.skeleton.place.hand`; the
surface is a smooth union of round cones, polygonised. Arms hang at 40° from the vertical, fingers are slightly spread.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.geometry.surface import Part, weld_surface
from warpjld.rig import Rig
from warpjld.skeleton.actor_points import ACTOR_PARENTS, ACTOR_POINTS, CANONICAL
from warpjld.skeleton.recognise.canonical import canonical_skeleton
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["actor_template", "build_body", "figure_surface"]

Array = NDArray[np.float64]

_ARM = np.radians(50.0)  # angle of the arms below the horizontal
_FINGERS = {
    # angle from the middle finger [°], then lengths [mm of a hand of 187] to base, knuckle2, knuckle3, tip's centre
    "index": (-15.0, 96.0, 39.8, 22.4, 15.0),
    "middle": (-1.0, 97.0, 44.6, 26.3, 16.5),
    "ring": (13.0, 92.0, 41.4, 25.7, 16.5),
    "pinky": (27.0, 85.0, 32.7, 18.1, 14.5),
}
_THUMB = (-52.0, 28.0, 44.0, 32.0, 20.0)
_FEWER = 0.8  # share of the contour's triangles that decimation removes
_SPLAY = 0.75  # angle of a finger relative to that of its metacarpal
_TRUNK = {
    "pelvis": (0.0, 0.535, 0.0),
    "vertebra1": (0.0, 0.575, -0.010),
    "vertebra2": (0.0, 0.618, -0.012),
    "vertebra3": (0.0, 0.672, -0.014),
    "vertebra4": (0.0, 0.755, -0.022),
    "vertebra5": (0.0, 0.842, -0.010),
    "skull_base": (0.0, 0.895, 0.002),
    "head_top": (0.0, 0.952, 0.008),
    "chin": (0.0, 0.872, 0.038),
    "nose_tip": (0.0, 0.908, 0.058),
    "sternum": (0.0, 0.810, 0.030),
    "left.clavicle": (0.014, 0.810, 0.028),
    "left.shoulder": (0.103, 0.805, -0.004),
    "left.pelvic_hip": (0.027, 0.530, 0.0),
    "left.femoral_head": (0.054, 0.525, 0.0),
    "left.knee": (0.060, 0.285, 0.006),
    "left.ankle": (0.064, 0.043, -0.010),
    "left.heel": (0.065, 0.018, -0.022),
    "left.ball": (0.072, 0.015, 0.070),
    "left.big_toe_tip": (0.062, 0.010, 0.104),
    "left.middle_toe_tip": (0.078, 0.009, 0.102),
    "left.little_toe_tip": (0.094, 0.008, 0.088),
}


def actor_template() -> dict[str, Array]:
    """Positions of the 87 points for a height of 1: x left, y up, z forward, the floor at y = 0."""
    points = {name: np.array(place) for name, place in _TRUNK.items()}
    down = np.array([np.cos(_ARM), -np.sin(_ARM), 0.0])
    forward, back = np.array([0.0, 0.0, 1.0]), np.array([np.sin(_ARM), np.cos(_ARM), 0.0])
    shoulder = points["left.shoulder"]
    elbow = shoulder + 0.172 * down
    wrist = elbow + 0.146 * unit(down + 0.06 * forward)
    points |= {"left.elbow": elbow, "left.forearm_twist": (elbow + wrist) / 2, "left.wrist": wrist}
    scale = 0.108 / 187.0

    def heading(degrees: float, lowered: float = 0.0) -> Array:
        # the hand hangs with the thumb's side forward and the palm towards the body
        angle = np.radians(degrees)
        return unit(np.cos(angle) * down - np.sin(angle) * forward - lowered * back)

    for name, (angle, palm, *bones) in _FINGERS.items():
        base = wrist + palm * scale * heading(angle)
        points[f"left.{name}.carpometacarpal"] = wrist + 0.36 * (base - wrist)
        _chain(points, f"left.{name}", base, [b * scale for b in bones], heading(_SPLAY * angle, 0.06))
    base = wrist + scale * (_THUMB[1] * down + 20.0 * forward - 8.0 * back)
    _chain(points, "left.thumb", base, [b * scale for b in _THUMB[2:]], heading(_THUMB[0], 0.2))
    mirrored = {name.replace("left.", "right."): p * (-1.0, 1.0, 1.0) for name, p in points.items() if "left." in name}
    points |= mirrored
    return {name: points[name] for name in ACTOR_POINTS}


def _chain(points: dict[str, Array], digit: str, base: Array, bones: list[float], direction: Array) -> None:
    """Add the joints of a straight digit to ``points``."""
    place = base
    points[f"{digit}.base"] = place
    for joint, length in zip(("knuckle2", "knuckle3", "tip"), bones, strict=True):
        place = place + length * direction
        points[f"{digit}.{joint}"] = place


def _radii() -> list[tuple[str, str, float, float]]:
    """Round cones: names of both end points and the radii there, relative to the height."""
    trunk = [
        ("pelvis", "vertebra2", 0.078, 0.070),
        ("vertebra2", "vertebra4", 0.070, 0.078),
        ("vertebra4", "vertebra5", 0.060, 0.033),
        ("vertebra5", "skull_base", 0.032, 0.036),
        ("skull_base", "head_top", 0.046, 0.050),
        ("skull_base", "chin", 0.036, 0.024),
        ("skull_base", "nose_tip", 0.044, 0.016),
        ("vertebra4", "sternum", 0.055, 0.030),
    ]
    limbs = []
    for side in ("left", "right"):
        limbs += [
            (f"{side}.{a}", f"{side}.{b}", ra, rb)
            for a, b, ra, rb in (
                ("clavicle", "shoulder", 0.028, 0.034),
                ("shoulder", "elbow", 0.033, 0.023),
                ("elbow", "wrist", 0.024, 0.0155),
                ("femoral_head", "knee", 0.045, 0.030),
                ("knee", "ankle", 0.033, 0.020),
                ("ankle", "heel", 0.022, 0.018),
                ("ankle", "ball", 0.022, 0.015),
                ("ball", "big_toe_tip", 0.014, 0.0095),
                ("ball", "middle_toe_tip", 0.013, 0.0085),
                ("ball", "little_toe_tip", 0.013, 0.0078),
            )
        ]
        limbs.append(("pelvis", f"{side}.femoral_head", 0.060, 0.046))
        limbs.append(("vertebra3", f"{side}.clavicle", 0.060, 0.030))
        for digit in (*_FINGERS, "thumb"):
            name = f"{side}.{digit}"
            thick = 0.0052 if digit != "thumb" else 0.0060
            first = f"{side}.wrist" if digit == "thumb" else f"{name}.carpometacarpal"
            limbs.append((first, f"{name}.base", 0.0105, 0.0088))
            limbs.append((f"{name}.base", f"{name}.knuckle2", 0.0066 if digit != "thumb" else 0.0085, thick))
            limbs.append((f"{name}.knuckle2", f"{name}.knuckle3", thick, 0.92 * thick))
            limbs.append((f"{name}.knuckle3", f"{name}.tip", 0.92 * thick, 0.84 * thick))
            if digit != "thumb":
                limbs.append((f"{side}.wrist", first, 0.0145, 0.0115))
    return trunk + limbs


def figure_surface(points: dict[str, Array], resolution: int = 300) -> tuple[Array, NDArray[np.int32]]:
    """Triangulate a closed smooth surface around an actor's points.

    Args:
        points: The 87 points, for a height of about 1.
        resolution: Number of voxels along the height.

    Returns:
        Vertices, shape (V, 3), and triangles, shape (T, 3).
    """
    import pyvista

    size = 1.0 / resolution
    places = np.array(list(points.values()))
    low, high = places.min(axis=0) - 0.09, places.max(axis=0) + 0.09
    shape = np.ceil((high - low) / size).astype(int) + 1
    far = 0.05
    field = np.full(shape, far)
    for a, b, first, last in _radii():
        _add_cone(field, low, size, points[a], points[b], first, last, far)
    grid = pyvista.ImageData(dimensions=shape, spacing=(size,) * 3, origin=low)
    grid["field"] = field.ravel(order="F")
    mesh = grid.contour([0.0], scalars="field").triangulate()
    mesh = mesh.clean().extract_largest().decimate_pro(_FEWER, preserve_topology=True)
    vertices, faces = np.asarray(mesh.points, dtype=np.float64), np.asarray(mesh.regular_faces, dtype=np.int32)
    return vertices, np.ascontiguousarray(faces[:, ::-1])  # anticlockwise seen from outside


def _add_cone(field: Array, low: Array, size: float, a: Array, b: Array, first: float, last: float, far: float) -> None:
    """Smooth union of a distance field with one round cone, in place; the blending radius is 0.35 of the smaller
    radius."""
    reach = max(first, last) + far
    start = np.maximum(np.floor((np.minimum(a, b) - reach - low) / size).astype(int), 0)
    stop = np.minimum(np.ceil((np.maximum(a, b) + reach - low) / size).astype(int) + 1, field.shape)
    box = tuple(slice(i, j) for i, j in zip(start, stop, strict=True))
    axes = [low[k] + size * np.arange(start[k], stop[k]) for k in range(3)]
    away = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) - a
    bone = b - a
    share = np.clip(away @ bone / max(float(bone @ bone), 1e-30), 0.0, 1.0)
    distance = np.linalg.norm(away - share[..., None] * bone, axis=-1) - (first + share * (last - first))
    blend = 0.35 * min(first, last)
    near = np.clip(0.5 + 0.5 * (field[box] - distance) / blend, 0.0, 1.0)
    field[box] = field[box] * (1.0 - near) + distance * near - blend * near * (1.0 - near)


def build_body(*, height: float = 1.75, resolution: int = 300) -> Rig:
    """The built-in body with joints exactly at its 87 points.

    Args:
        height: From the floor to the crown [m].
        resolution: Number of voxels along the height from which its surface is made.

    Raises:
        InputError: A height or resolution out of range.

    Examples:
        >>> wj.build_body()
        Rig('body': 87 joints, ... vertices, ... triangles)
    """
    if not 0.5 <= height <= 2.6:
        raise InputError(f"height: want metres, between 0.5 and 2.6, got {height!r}")
    if not 250 <= resolution <= 1000:
        raise InputError(f"resolution: want voxels in the height, between 250 and 1000, got {resolution!r}")
    points = actor_template()
    vertices, faces = figure_surface(points, resolution)
    low, tall = float(vertices[:, 1].min()), float(np.ptp(vertices[:, 1]))
    scale, lift = height / tall, np.array([0.0, low, 0.0])
    placed = {name: (place - lift) * scale for name, place in points.items()}
    return _rig(placed, (vertices - lift) * scale, faces)


def _rig(points: dict[str, Array], vertices: Array, faces: NDArray[np.int32]) -> Rig:
    """The rig of a body's points and surface [m]."""
    names = list(points)
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = list(points.values())
    parents = np.array([names.index(above) if (above := ACTOR_PARENTS[name]) else -1 for name in names])
    tree = SourceTree(tuple(names), parents, frames)
    stated = {CANONICAL[name]: name for name in names}
    found = canonical_skeleton(tree, vertices, faces, roles=recognise(tree, None, stated), placed=True)
    return Rig(
        name="body",
        skeleton=found.skeleton,
        surface=weld_surface(vertices, faces, parts=(Part("body", slice(0, len(vertices)), slice(0, len(faces))),)),
        source=tree,
        sources=found.sources,
        owner=found.owner,
    )
