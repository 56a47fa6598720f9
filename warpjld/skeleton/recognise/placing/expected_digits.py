"""Expected positions of the joints of digits (R14).

A finger's joint lies where the lengths of its bones fit those of the other fingers: see ``bone_lengths``. Thumbs are
compared with the middle of the range of existing rigs. One criterion for both: the joint is named whose displacement
explains most, and with it any other that explains nearly as much. Tolerances are the largest deviations found in
existing rigs.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.recognise.placing.bone_lengths import MEAN_LENGTHS, displaced_joints
from warpjld.skeleton.recognise.placing.expected import Expectation

__all__ = ["finger_expectations"]

Array = NDArray[np.float64]
Joints = Mapping[str, Array]

_FEWEST = 3  # fingers that are compared with one another
_ALONG = 0.044
"""Tolerance for a joint of a finger against the other fingers, per length of the palm: a tenth more than the largest
deviation in existing rigs (0.040)."""
_ALIKE = 0.65  # share of what one joint of a thumb explains from which the other may be the one, as of fingers
_THUMB = (0.51, 0.65)  # usual place of second and third joint between their neighbours, as a share
_THUMB_ALONG = 0.08  # tolerance for them, per length of both bones


def finger_expectations(joints: Joints, aside: Mapping[str, float] = MappingProxyType({})) -> list[Expectation]:
    """Joints of digits whose relative position differs from that of the other digits.

    Args:
        joints: Canonical joints → positions [m].
        aside: Deviations across the bone in units of their tolerance, which leave less for one along the bone.
    """
    out: list[Expectation] = []
    for side in ("left.", "right.", ""):
        out += _thumb(side, joints, aside)
        wrist = joints.get(f"{side}wrist")
        digits = [digit for digit in MEAN_LENGTHS if all(f"{side}{digit}.{joint}" in joints for joint in FINGER_JOINTS)]
        if len(digits) >= _FEWEST and wrist is not None:
            out += _fingers(side, digits, joints, wrist, aside)
    return out


def _fingers(
    side: str, digits: list[str], joints: Joints, wrist: Array, aside: Mapping[str, float]
) -> list[Expectation]:
    chains = np.array([[wrist, *(joints[f"{side}{digit}.{joint}"] for joint in FINGER_JOINTS)] for digit in digits])
    means = np.array([MEAN_LENGTHS[digit] for digit in digits])
    palms = np.linalg.norm(chains[:, 1] - chains[:, 0], axis=1) / means[:, 0]
    tolerance = _ALONG * float(np.median(palms)) * MEAN_LENGTHS["middle"][0]
    names = [[f"{side}{digit}.{joint}" for joint in FINGER_JOINTS] for digit in digits]
    smallest = tolerance * np.array([[_tolerated(aside, name) for name in row[:3]] for row in names])
    out = []
    for one in displaced_joints(chains, means, smallest):
        tolerances = dict.fromkeys(one.by, tolerance)
        out += _either(names[one.finger], chains[one.finger], one.by, tolerances, "beside the other fingers")
    return out


def _thumb(side: str, joints: Joints, aside: Mapping[str, float]) -> list[Expectation]:
    """The joint of a thumb whose displacement explains most; a thumb has no comparable neighbour."""
    names = [f"{side}thumb.{joint}" for joint in FINGER_JOINTS]
    if not all(name in joints for name in names):
        return []
    chain = np.array([joints[name] for name in names])
    bones = np.linalg.norm(np.diff(chain, axis=0), axis=1)
    both = bones[:2] + bones[1:]
    share = np.array(_THUMB)
    off, most = bones[:2] - share * both, _THUMB_ALONG * both
    if not (np.abs(off) > most * [_tolerated(aside, name) for name in names[1:3]]).any():
        return []
    # displaced by s towards the tip, second or third joint changes the deviations by s times a row
    rows = np.array([[1.0, share[1] - 1.0], [-share[0], 1.0]]) / most
    by = rows @ (off / most) / (rows**2).sum(axis=1)
    explained = by**2 * (rows**2).sum(axis=1)
    found = {k + 1: float(by[k]) for k in np.flatnonzero(explained > _ALIKE * explained.max()).tolist()}
    tolerances = {k: float(most[k - 1]) for k in found}
    whole = np.array([chain[0], *chain])  # the bone before its base has no part in it
    return _either(names, whole, found, tolerances, "for the lengths of a thumb's bones")


def _either(
    names: list[str], chain: Array, found: Mapping[int, float], tolerances: Mapping[int, float], beside: str
) -> list[Expectation]:
    """Expectations of the joints of a digit of which one is displaced along it.

    Args:
        names: Its joints.
        chain: The wrist and they [m], shape (5, 3).
        found: Places of the joints in ``names`` → how far each is too far out [m].
        tolerances: Likewise [m].
        beside: What they are compared with, for the user.
    """
    out = []
    for k, off in found.items():
        before, at, after = chain[k : k + 3]
        place = at - off * unit(after - at) if k == 0 or off < 0.0 else at + off * unit(before - at)
        detail = f"{abs(1e3 * off):.1f} mm too far {'out' if off > 0 else 'in'} {beside}"
        others = " or ".join(names[other] for other in found if other != k)
        detail += f"; either it or {others} is wrong" if others else ""
        out.append(Expectation(names[k], "proportion", place, abs(off), detail, abs(off) / tolerances[k]))
    return out


def _tolerated(aside: Mapping[str, float], name: str) -> float:
    """Share of the tolerance along the bone that a deviation across it leaves."""
    return float(np.sqrt(1.0 - min(aside.get(name, 0.0), 1.0) ** 2))
