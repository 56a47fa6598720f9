"""Joints of spine and head in the flesh of the trunk (R14)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.recognise.complete_body import find_extremities
from warpjld.skeleton.recognise.placing.finding import Finding, millimetres
from warpjld.skeleton.recognise.section import skin_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["body_frame", "check_crown", "check_spine"]

_CROWN = 0.02  # tolerance of the head's extremity, per height of the body: about half a head's radius
_SPINE_AT = 0.3  # proposed place of a spine joint, per depth of the trunk from its back
_SPINE = (0.07, 0.56)
"""Range of the place of spine joints, per depth of the trunk from its back: .15 to .46 in existing rigs."""


def check_crown(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> list[Finding]:
    """Check the head's extremity against the centre of the head's rounded top."""
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    up, _ = body_frame(joints)
    if up is None or "head.top" not in joints:
        return []
    parents = {
        name: skeleton.names[parent] if parent >= 0 else None
        for name, parent in zip(skeleton.names, skeleton.parents, strict=True)
        if name != "head.top"
    }
    kept = {"head", "neck1", "spine1", "pelvis"} & set(joints)
    found = find_extremities({n: joints[n] for n in kept}, {n: parents[n] for n in kept}, vertices, faces)
    if "head.top" not in found:
        return []
    offset = found["head.top"][1] - joints["head.top"]
    off, height = float(np.linalg.norm(offset)), float(np.ptp(vertices[np.unique(faces)] @ up))
    if off <= _CROWN * height:
        return []
    detail = f"{1e3 * off:.0f} mm from the centre of the head's round top"
    return [Finding("head.top", "extremity", off, detail, millimetres(offset))]


def body_frame(
    joints: Mapping[str, NDArray[np.float64]],
) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Up and forward of an upright body, each snapped to the nearest coordinate axis; None where joints are missing.

    Snapped, because one of the joints may be the misplaced one.
    """
    if not {"pelvis", "head", "left.hip", "right.hip"} <= set(joints):
        return None, None
    along = joints["head"] - joints["pelvis"]
    k = int(np.abs(along).argmax())
    up = np.sign(along[k]) * np.eye(3)[k]
    across = np.cross(joints["left.hip"] - joints["right.hip"], up)
    across[k] = 0.0
    j = int(np.abs(across).argmax())
    return up, np.sign(across[j]) * np.eye(3)[j]


def check_spine(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32], inside: NDArray[np.bool_]
) -> list[Finding]:
    """Joints of the spine too near to belly or back."""
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    _, forward = body_frame(joints)
    names = [n for j, n in enumerate(skeleton.names) if n.startswith("spine") and inside[j]]
    if forward is None or not names:
        return []
    origins = np.repeat([joints[n] for n in names], 2, axis=0)
    rays = np.tile([-forward, forward], (len(names), 1))
    reach = skin_hits(vertices, faces, origins, rays).reshape(-1, 2)
    out = []
    for name, (back, front) in zip(names, reach, strict=True):
        whole = back + front
        if np.isfinite(whole) and not _SPINE[0] <= back / whole <= _SPINE[1]:
            detail = f"{1e3 * back:.0f} mm of flesh at the back, {1e3 * front:.0f} at the front"
            offset = (_SPINE_AT * whole - back) * forward
            out.append(Finding(name, "off-centre", float(back / whole), detail, millimetres(offset)))
    return out
