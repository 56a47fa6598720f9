"""Units and up axis: everything inside is metres and Y up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.io.source import SourceRig
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["METRES", "place"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_HAND = (0.08, 0.30)  # wrist to middle fingertip or last knuckle, children to giants [m]
_BODY = (0.5, 2.6)  # ankle to head [m]


def place(
    source: SourceRig, *, unit: str | None = None, scale: float | None = None, up: str | None = None
) -> SourceRig:
    """``source`` in metres with Y up; guesses are noted.

    Args:
        source: What the file says.
        unit: ``m``, ``cm``, ``mm`` or None: the one with which hand or body has a plausible size.
        scale: Factor by which all lengths are multiplied besides; where it is given and ``unit`` is not, nothing is
            guessed: the file is taken to be in metres.
        up: ``y``, ``z`` or None: Z only where a body's head lies that way from its hips.
    """
    notes = []
    factor = (1.0 if unit is None else METRES[unit]) * (1.0 if scale is None else scale)
    roles = recognise(source.tree, source.stated_names()) if unit is None or up is None else Roles()
    if unit is None and scale is None:
        size, plausible, what = _size(source.tree, roles)
        if size and not plausible[0] <= size <= plausible[1]:
            fits = [u for u, f in METRES.items() if plausible[0] <= size * f <= plausible[1]]
            if fits:
                factor = METRES[fits[0]]
                notes.append(f"unit: a {what} of {size:.4g} units is taken to be in {fits[0]}")
            else:
                notes.append(f"unit: a {what} of {size:.4g} m is not plausible in m, cm or mm: left as it is")
    if up is None and _lies_on_z(source.tree, roles):
        up = "z"
        notes.append("up axis: the body stands along Z, turned to Y")
    turn = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]) if up == "z" else np.eye(3)
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
            return _distance(tree, joints["wrist"], last), _HAND, "hand"
    return 0.0, (0.0, 0.0), ""


def _lies_on_z(tree: SourceTree, roles: Roles) -> bool:
    if "pelvis" not in roles.body or "head" not in roles.body:
        return False
    trunk: NDArray[np.float64] = tree.positions[roles.body["head"]] - tree.positions[roles.body["pelvis"]]
    return bool(trunk[2] > 0.9 * np.linalg.norm(trunk))


def _distance(tree: SourceTree, a: int, b: int) -> float:
    return float(np.linalg.norm(tree.positions[a] - tree.positions[b]))
