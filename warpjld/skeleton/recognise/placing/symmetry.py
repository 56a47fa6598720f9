"""Symmetry of a body's joints, and deviations that both sides share (R14).

Two joints that were misplaced by accident are not mirror images of each other. What both sides have in the same way is
the rig's own design, which is accepted up to twice the usual tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.placing.finding import Finding

__all__ = ["FEWEST_PAIRS", "left_and_right", "sagittal_plane", "without_shared"]

FEWEST_PAIRS = 4  # joints of both sides that define a plane of symmetry, of which one may be misplaced
_ALIKE = 0.004  # largest median asymmetry of a symmetric rest pose, per height of the body
_SHARED = 2.0  # largest deviation of both sides that is a design, in units of its tolerance
_DESIGN = ("off-centre", "extremity", "proportion")


def left_and_right(
    joints: Mapping[str, NDArray[np.float64]],
) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Joints of both sides by their name without the side: positions at the left and at the right."""
    return {
        name[5:]: (place, joints[f"right.{name[5:]}"])
        for name, place in joints.items()
        if name.startswith("left.") and f"right.{name[5:]}" in joints
    }


def sagittal_plane(
    pairs: Mapping[str, tuple[NDArray[np.float64], NDArray[np.float64]]], height: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Normal of the sagittal plane (unit, to the left), a point of it, and whether the sides are mirror images.

    Args:
        pairs: Joints of both sides [m], as of ``left_and_right``.
        height: Height of the body [m].
    """
    a = np.array([pair[0] for pair in pairs.values()])
    b = np.array([pair[1] for pair in pairs.values()])
    good = np.ones(len(a), dtype=bool)
    for _ in range(3):
        left = unit((a - b)[good].sum(axis=0))
        middle = np.median(((a + b) / 2)[good], axis=0)
        mirrored = b - 2.0 * ((b - middle) @ left)[:, None] * left
        off = np.linalg.norm(a - mirrored, axis=1)
        good = off <= max(float(np.median(off)), _ALIKE * height)
    return left, middle, bool(np.median(off) < _ALIKE * height)


def without_shared(findings: list[Finding], joints: Mapping[str, NDArray[np.float64]], height: float) -> list[Finding]:
    """Findings without those of a joint whose mirror image has the same.

    Args:
        findings: Of all joints.
        joints: Canonical joints → positions [m].
        height: Height of the surface [m].
    """
    pairs = left_and_right(joints)
    if len(pairs) < FEWEST_PAIRS:
        return findings
    left, middle, alike = sagittal_plane(pairs, height)
    if not alike:
        return findings
    graded = {(one.joint, one.kind): one.excess for one in findings if one.kind in _DESIGN}

    def shared(one: Finding) -> bool:
        side, _, name = one.joint.partition(".")
        other = f"{'right' if side == 'left' else 'left'}.{name}"
        if name not in pairs or max(one.excess, graded.get((other, one.kind), np.inf)) > _SHARED:
            return False
        a, b = pairs[name]
        mirrored = b - 2.0 * float((b - middle) @ left) * left
        return (one.joint, one.kind) in graded and float(np.linalg.norm(a - mirrored)) <= _ALIKE * height

    return [one for one in findings if not shared(one)]
