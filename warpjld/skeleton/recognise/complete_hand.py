"""Completion of a hand to all 25 joints: carpal ends, missing knuckles and fingertips are added."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.geometry.winding import winding_numbers
from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.extremity import find_extremity
from warpjld.skeleton.recognise.section import nearby, skin_hits

__all__ = ["complete_hand"]

_CARPAL_SHARE = 0.4  # carpal end, as a share of wrist to finger base (WebXR hand: 0.39 index, 0.5 pinky)
_FINGERS = tuple(d for d in DIGITS if d != "thumb")


def complete_hand(
    found: Mapping[str, NDArray[np.float64]],
    directions: Mapping[str, NDArray[np.float64]],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    label: str = "hand",
) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Positions of all of a hand's joints; missing ones are added, misplaced ones moved.

    Args:
        found: Canonical names without the side → positions [m].
        directions: Direction of the bone beyond each last joint, where its frame gives one.
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        label: Name of this hand in notes.

    Returns:
        Positions, and notes on what was added or moved.
    """
    points = dict(found)
    notes: list[str] = []
    if "wrist" not in points:
        points["wrist"] = _wrist(points)
        notes.append(f"{label}: no wrist joint, placed from the fingers")
    fingers = [d for d in _FINGERS if f"{d}.base" in points]
    reach = max(float(np.linalg.norm(p - points["wrist"])) for p in points.values())
    faces = nearby(vertices, faces, points["wrist"], 1.6 * reach)
    _carpal_ends(points, fingers, notes, label)
    derived: list[str] = []
    moved: list[str] = []
    for digit in (*fingers, *(("thumb",) if "thumb.base" in points else ())):
        tip = f"{digit}.tip"
        had = points.get(tip)
        centre = _tip(points, digit, directions, vertices, faces)
        if had is None or _at_skin(had, centre, vertices, faces):
            points[tip] = centre
            (derived if had is None else moved).append(digit)
        _missing_knuckles(points, digit, notes, label)
    if derived:
        notes.append(f"{label}: no tip joints for {', '.join(derived)}: placed in the centre of the fingertip")
    if moved:
        notes.append(f"{label}: {', '.join(moved)}: tips at or outside the surface, moved to the fingertip's centre")
    return points, notes


def _wrist(points: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    fingers = [d for d in _FINGERS if f"{d}.base" in points and f"{d}.knuckle2" in points]
    bases = np.mean([points[f"{d}.base"] for d in fingers], axis=0)
    carpals = [points[f"{d}.carpometacarpal"] for d in fingers if f"{d}.carpometacarpal" in points]
    if carpals:
        start = np.mean(carpals, axis=0)
        return start - 0.6 * (bases - start)
    # palm and middle finger are about equally long; the proximal phalanx is 0.45 of a finger
    forward = np.mean([points[f"{d}.knuckle2"] - points[f"{d}.base"] for d in fingers], axis=0)
    return bases - 2.2 * forward


def _carpal_ends(points: dict[str, NDArray[np.float64]], fingers: list[str], notes: list[str], label: str) -> None:
    wrist, added = points["wrist"], []
    for digit in fingers:
        name, base = f"{digit}.carpometacarpal", points[f"{digit}.base"]
        length = np.linalg.norm(base - wrist)
        if name in points and np.linalg.norm(points[name] - wrist) > 0.02 * length:
            continue
        points[name] = wrist + _CARPAL_SHARE * (base - wrist)
        added.append(digit)
    if added:
        notes.append(f"{label}: no carpal ends of {', '.join(added)} of their own: placed between wrist and base")
    groups: list[list[str]] = []
    for digit in fingers:  # neighbours whose carpal ends coincide
        at = points[f"{digit}.carpometacarpal"]
        if groups and np.linalg.norm(at - points[f"{groups[-1][-1]}.carpometacarpal"]) < 1e-3 * np.linalg.norm(
            points[f"{digit}.base"] - at
        ):
            groups[-1].append(digit)
        else:
            groups.append([digit])
    shared = [g for g in groups if len(g) > 1]
    if not shared:
        return
    row = points[f"{fingers[0]}.base"] - points[f"{fingers[-1]}.base"]  # towards the ulnar side
    heads = [points[f"{g[0]}.carpometacarpal"] for g in groups]
    # two groups: their distance spans two fingers; a single group takes a share of the knuckle row's spacing
    across = (heads[0] - heads[-1]) / 2 if len(groups) == 2 else 0.5 * row / max(len(fingers) - 1, 1)
    for group in shared:
        for k, digit in enumerate(group):
            points[f"{digit}.carpometacarpal"] = points[f"{digit}.carpometacarpal"] + across * (
                (len(group) - 1) / 2 - k
            )
        notes.append(f"{label}: metacarpals of {' and '.join(group)} share one head: moved apart along the carpal row")


def _tip(
    points: dict[str, NDArray[np.float64]],
    digit: str,
    directions: Mapping[str, NDArray[np.float64]],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
) -> NDArray[np.float64]:
    present = [j for j in FINGER_JOINTS[:3] if f"{digit}.{j}" in points]
    last = f"{digit}.{present[-1]}"
    before = points[f"{digit}.{present[-2]}"] if len(present) > 1 else points["wrist"]
    bone = points[last] - before
    length = float(np.linalg.norm(bone))
    direction = directions.get(last, bone / length)
    if (had := points.get(f"{digit}.tip")) is not None:
        direction = unit(had - points[last])
    found = find_extremity(vertices, faces, points[last], direction, length)
    return points[last] + 0.7 * length * direction if found is None else found


def _at_skin(
    had: NDArray[np.float64], centre: NDArray[np.float64], vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> bool:
    """Whether a tip is outside, or nearer to the end of its finger than to the fingertip's centre, so that it marks the
    end."""
    if winding_numbers(vertices, faces, had[None])[0] < 0.5:
        return True
    away = had - centre
    beyond = float(np.linalg.norm(away))
    return beyond > 0.0 and float(skin_hits(vertices, faces, had[None], away[None] / beyond)[0]) < beyond


def _missing_knuckles(points: dict[str, NDArray[np.float64]], digit: str, notes: list[str], label: str) -> None:
    chain = [f"{digit}.{j}" for j in FINGER_JOINTS]
    missing = [name for name in chain if name not in points]
    for name in missing:
        k = chain.index(name)
        left = 4 - k  # segments from the joint before to the tip
        points[name] = points[chain[k - 1]] + (points[chain[-1]] - points[chain[k - 1]]) / left
    if missing:
        notes.append(f"{label}: {', '.join(missing)} added between the neighbouring joints")
