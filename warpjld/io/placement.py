"""Units and up axis: everything inside is metres and Y up."""

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
_HAND = (0.10, 0.30)  # wrist to middle fingertip, children of three to giants [m]
_FINGERTIP = 1.15  # hand's length per distance from the wrist to the last knuckle
_SMALLER, _LARGER = 0.6, 1.2  # beyond plausible sizes that a unit is guessed for
_BODY = (0.5, 2.6)  # ankle to head [m]


def place(
    source: SourceRig, roles: Roles, *, unit: str | None = None, scale: float | None = None, up: str | None = None
) -> SourceRig:
    """``source`` in metres with Y up; guesses are noted, and an implausible size is told.

    Args:
        source: What the file says.
        roles: What was recognised in its joints.
        unit: ``m``, ``cm``, ``mm``, ``in`` or None: what the file says, else the one with which hand or body has a
            plausible size.
        scale: Factor by which all lengths are multiplied besides; where it is given and ``unit`` is not, nothing is
            guessed: a file that does not say is taken to be in metres.
        up: ``y``, ``z`` or None: what the file says, else Z only where a body's head lies that way from its hips.
    """
    notes: list[str] = []
    doubts: list[str] = []
    own = 1.0 if source.metres is None else source.metres
    factor = (own if unit is None else METRES[unit]) * (1.0 if scale is None else scale)
    size, plausible, what = _size(source.tree, roles)
    possible = (_SMALLER * plausible[0], _LARGER * plausible[1])
    guess = unit is None and scale is None and source.metres is None
    if guess and size and not possible[0] <= size <= possible[1]:
        # inches only where no metric unit gives a usual size
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
    frames[:, :3, :3] = turn @ frames[:, :3, :3]  # directions turn, they do not scale
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
    """What is said of a size that no hand or body has, with the factor that would bring it to a usual one."""
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
