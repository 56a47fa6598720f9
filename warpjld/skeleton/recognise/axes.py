"""Flexion axes from geometry (R20): segment × axis points out of the back of the hand or limb.

Bone frames follow four conventions, none of them reliably, so axes are derived from joint positions: a finger is a
planar chain whose plane is given by its rest bend, or by the palm where it is straight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.recognise.hand_frame import HandFrame, hand_frame

__all__ = ["body_axes", "hand_axes", "perpendicular"]

Points = Mapping[str, NDArray[np.float64]]

# Weight of the expected axis against the measured bend: squared sine of the bend at which both weigh equally
_FINGER_PRIOR = np.sin(np.radians(20.0)) ** 2
_THUMB_PRIOR = np.sin(np.radians(25.0)) ** 2
_LIMB_PRIOR = np.sin(np.radians(20.0)) ** 2
_HINGES = {"elbow": ("shoulder", "elbow", "wrist"), "knee": ("hip", "knee", "ankle")}
_TRUNK = ("spine", "neck", "head")


def hand_axes(points: Points, side: str) -> dict[str, NDArray[np.float64]]:
    """Flexion axis of every joint of a hand, names without the side."""
    frame = hand_frame(points, side)
    carpals = [p for name, p in points.items() if name.endswith("carpometacarpal") or name == "thumb.base"]
    towards = np.sum([p - points["wrist"] for p in carpals], axis=0)
    axes = {"wrist": _hinge(frame.dorsal, towards)}
    for digit in ("pinky", "ring", "middle", "index"):
        if f"{digit}.base" in points:
            axes |= _finger_axes(points, digit, frame)
    if "thumb.base" in points:
        axes |= _thumb_axes(points, frame)
    return axes


def _finger_axes(points: Points, digit: str, frame: HandFrame) -> dict[str, NDArray[np.float64]]:
    carpal, *chain = [points[f"{digit}.{j}"] for j in ("carpometacarpal", *FINGER_JOINTS)]
    expected = _hinge(frame.dorsal, chain[-1] - chain[0])
    hinge = _common_hinge(chain, expected, _FINGER_PRIOR)
    axes = {f"{digit}.carpometacarpal": _hinge(frame.dorsal, chain[0] - carpal)}
    return axes | _axes_along(digit, chain, hinge)


def _thumb_axes(points: Points, frame: HandFrame) -> dict[str, NDArray[np.float64]]:
    """The thumb flexes across the palm, towards the base of the little finger in front of the palm's surface.

    Its nail then faces about 70° away from the back of the hand.
    """
    chain = [points[f"thumb.{j}"] for j in FINGER_JOINTS]
    bases = [points[f"{d}.base"] for d in ("index", "middle", "ring", "pinky") if f"{d}.base" in points]
    width = np.linalg.norm(bases[0] - bases[-1])
    target = bases[-1] - 0.5 * width * frame.dorsal
    bone = chain[-1] - chain[1]
    expected = perpendicular(np.cross(bone, target - chain[1]), bone)
    return _axes_along("thumb", chain, _common_hinge(chain, expected, _THUMB_PRIOR))


def _common_hinge(
    chain: Sequence[NDArray[np.float64]], expected: NDArray[np.float64], prior: float
) -> NDArray[np.float64]:
    """Axis most nearly perpendicular to all bones of a chain, regularised towards the expected axis.

    Minimises Σ (axis · bone)² + prior |axis − expected|².
    """
    bones = unit(np.diff(np.array(chain), axis=0))
    return unit(np.linalg.solve(bones.T @ bones + prior * np.eye(3), prior * expected))


def _axes_along(
    digit: str, chain: Sequence[NDArray[np.float64]], hinge: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    axes = {
        f"{digit}.{joint}": perpendicular(hinge, after - at)
        for joint, at, after in zip(FINGER_JOINTS, chain, chain[1:], strict=False)
    }
    return axes | {f"{digit}.tip": axes[f"{digit}.knuckle3"]}


def body_axes(
    points: Points,
    directions: Mapping[str, NDArray[np.float64]],
    up: NDArray[np.float64],
    forward: NDArray[np.float64],
) -> dict[str, NDArray[np.float64]]:
    """Flexion axes of a body's joints, by anatomical convention.

    Shoulders raise the arm forward, elbows bring the hand forward, hips raise the thigh forward, knees bring the heel
    back, ankles and toes point down, trunk, neck and head bow forward. Elbows and knees take the plane of their rest
    bend if they are bent.

    Args:
        points: Canonical joints → positions [m].
        directions: Unit directions of their bones.
        up: The body's up direction, a unit vector.
        forward: The direction it faces.
    """
    axes: dict[str, NDArray[np.float64]] = {}
    left = np.cross(up, forward)
    for name, bone in directions.items():
        side, _, part = name.rpartition(".")
        if part in ("shoulder", "elbow", "clavicle", "hip", "pelvis", "top") or part.rstrip("0123456789") in _TRUNK:
            flexed = forward
        elif part == "knee":
            flexed = -forward
        elif part in ("ankle", "ball") or ".toe" in name:
            flexed = -up
        else:
            continue
        axis = np.cross(bone, flexed)
        axes[name] = perpendicular(axis if np.linalg.norm(axis) > 0.2 else -left, bone)
        chain = _HINGES.get(part)
        if chain and all(f"{side}.{joint}" in points for joint in chain):
            hinge = _common_hinge([points[f"{side}.{joint}"] for joint in chain], axes[name], _LIMB_PRIOR)
            axes[name] = perpendicular(hinge, bone)
    return axes


def _hinge(dorsal: NDArray[np.float64], bone: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axis of a bone whose back faces ``dorsal``: bone × axis = dorsal where they are perpendicular."""
    return perpendicular(np.cross(dorsal, bone), bone)


def perpendicular(axis: NDArray[np.float64], bone: NDArray[np.float64]) -> NDArray[np.float64]:
    """``axis`` without its component along ``bone``, normalised."""
    direction = unit(bone)
    for guess in (axis, *np.eye(3)):  # an axis along the bone is undetermined: any perpendicular one is taken
        across = guess - direction * (direction @ guess)
        length = np.linalg.norm(across)
        if length > 1e-6 * max(float(np.linalg.norm(guess)), 1e-30):
            return across / length
    return np.array([1.0, 0.0, 0.0])
