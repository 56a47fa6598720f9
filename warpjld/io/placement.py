"""Conversion of a file's units and up axis to metres and Y up, with guesses where the file does not state them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import upright
from warpjld.io.source import SourceRig
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["METRES", "place"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
_WORDS = {"in": "inches"}
_HAND = (0.10, 0.30)  # plausible length from wrist to middle fingertip, from children of three to giants [m]
_FINGERTIP = 1.15  # length of a hand, per distance from the wrist to the last knuckle
_SMALLER, _LARGER = 0.6, 1.2  # factors that widen plausible sizes for guessing a unit
_BODY = (0.5, 2.6)  # plausible height from ankle to head [m]


def place(
    source: SourceRig, roles: Roles, *, unit: str | None = None, scale: float | None = None, up: str | None = None
) -> SourceRig:
    """``source`` in metres with Y up; guesses are noted, and an implausible size gives a warning.

    Args:
        source: Content of the file.
        roles: Recognised joints.
        unit: ``m``, ``cm``, ``mm``, ``in`` or None: the file's unit if stated, else the one that gives hand or body a
            plausible size.
        scale: Additional factor for all lengths; if it is given without ``unit``, nothing is guessed: the unit is the
            file's, or metres.
        up: ``y``, ``z`` or None: the file's axis if stated, else Z if a body's head is in that direction from its
            pelvis.
    """
    notes: list[str] = []
    doubts: list[str] = []
    own = 1.0 if source.metres is None else source.metres
    factor = (own if unit is None else METRES[unit]) * (1.0 if scale is None else scale)
    size, plausible, what = _size(source.tree, roles)
    possible = (_SMALLER * plausible[0], _LARGER * plausible[1])
    guess = unit is None and scale is None and source.metres is None
    if guess and size and not possible[0] <= size <= possible[1]:
        # inches only if no metric unit gives a usual size
        usual = [u for u, f in METRES.items() if plausible[0] <= size * f <= plausible[1]]
        fits = usual or [u for u, f in METRES.items() if u != "in" and possible[0] <= size * f <= possible[1]]
        if fits:
            factor = METRES[fits[0]]
            notes.append(f"unit: a {what} of {size:.4g} units is taken to be in {_WORDS.get(fits[0], fits[0])}")
    if size and not plausible[0] <= size * factor <= plausible[1]:
        doubts.append(_implausible(size * factor, plausible, what, (scale or 1.0)))
    if up is None and source.up is not None:
        up = source.up
        if up == "y" and _lies_on_z(source.tree, roles):
            doubts.append("up axis: the file says Y, yet the body lies along Z: give --up z if it is wrong")
    elif up is None and _lies_on_z(source.tree, roles):
        up = "z"
        notes.append("up axis: the body stands along Z, turned to Y")
    turn = upright(up)
    placing = np.eye(4)
    placing[:3, :3] = factor * turn
    frames = source.tree.frames.copy()
    frames[:, :3, :3] = turn @ frames[:, :3, :3]  # axes are rotated, not scaled
    frames[:, :3, 3] = factor * frames[:, :3, 3] @ turn.T
    return replace(
        source,
        vertices=factor * source.vertices @ turn.T,
        tree=replace(source.tree, frames=frames),
        axes={j: turn @ axis for j, axis in source.axes.items()},
        placing=placing @ source.placing,
        notes=(*source.notes, *notes),
        suspicious=(*source.suspicious, *doubts),
    )


def _size(tree: SourceTree, roles: Roles) -> tuple[float, tuple[float, float], str]:
    body = roles.body
    if "head" in body and ("left.ankle" in body or "right.ankle" in body):
        ankle = body.get("left.ankle", body.get("right.ankle", 0))
        return _distance(tree, ankle, body["head"]), _BODY, "body"
    for hand in roles.hands:
        joints = hand.joints
        last = next((joints[f"middle.{j}"] for j in ("tip", "knuckle3", "knuckle2") if f"middle.{j}" in joints), None)
        if "wrist" in joints and last is not None:
            reach = 1.0 if "middle.tip" in joints else _FINGERTIP
            return reach * _distance(tree, joints["wrist"], last), _HAND, "hand"
    return 0.0, (0.0, 0.0), ""


def _implausible(size: float, plausible: tuple[float, float], what: str, scale: float) -> str:
    """Warning about an implausible size, with the factor that would give a usual one."""
    usual = {"hand": 0.19, "body": 1.5}[what]
    ends = {"hand": "from wrist to fingertip", "body": "from ankle to head"}[what]
    reach = f"{plausible[0]:g} to {plausible[1]:g} m"
    return (
        f"size: this {what} measures {size:.4g} m {ends}; {reach} are plausible. Objects and recorded motion in metres "
        f"do not fit it: give its unit or --scale (about {scale * usual / size:.3g})"
    )


def _lies_on_z(tree: SourceTree, roles: Roles) -> bool:
    if "pelvis" not in roles.body or "head" not in roles.body:
        return False
    trunk: NDArray[np.float64] = tree.positions[roles.body["head"]] - tree.positions[roles.body["pelvis"]]
    return bool(trunk[2] > 0.9 * np.linalg.norm(trunk))


def _distance(tree: SourceTree, a: int, b: int) -> float:
    return float(np.linalg.norm(tree.positions[a] - tree.positions[b]))
