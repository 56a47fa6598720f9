"""Expected positions of joints along limbs and spine, and mirrored from the other side (R14).

One criterion: a joint lies where comparable joints of the same body lie. For limbs these are the other side and the two
halves of the limb, for the spine its neighbours and the midline; for digits see ``expected_digits``. Tolerances are the
largest deviations found in existing rigs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.recognise.placing.symmetry import FEWEST_PAIRS, left_and_right, sagittal_plane

__all__ = ["Expectation", "body_expectations"]

Array = NDArray[np.float64]
Joints = Mapping[str, Array]

_LIMBS = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
_HALVES = 1.32  # largest ratio of a limb's halves: 1.02 to 1.13 are usual, knees a tenth of the leg off give 1.4
_ASIDE = 0.012  # tolerance from the midline, or from the mirror image, per height of the body
_HAND_ASIDE = 0.0035  # likewise in hands and feet, whose joints are closer together
_SCALE = 0.5
"""Oddity of a hip or shoulder as far from its usual place as is tolerated: that of a place with thrice the flesh on one
side (0.5), so that neither measure outweighs the other. Flesh of many pieces, of which rays meet inner ones, says
little."""
_CLEARLY = 1.25  # ratio of oddities at which one side is clearly the wrong one
_USUAL = {"hip": (0.055, 0.53), "shoulder": (0.1, 0.8)}
"""Distances from the midline and from the floor, per height of the body (Drillis, Contini 1966)."""
_BETWEEN = (0.27, 0.70)  # range of a spine joint's place between its neighbours, as a share
_MIDDLE = 0.48  # its proposed place, from the joint below to the one above


@dataclass(frozen=True, eq=False)
class Expectation:
    """A joint that is not where it is expected.

    Attributes:
        joint: Its name.
        kind: ``proportion``, ``asymmetric`` or ``midline``.
        place: Expected position [m], shape (3,).
        amount: Distance from it [m].
        detail: Description of the deviation for the user.
        excess: Distance in units of its tolerance.
    """

    joint: str
    kind: str
    place: Array
    amount: float
    detail: str
    excess: float = 1.0


def body_expectations(
    joints: Joints, up: Array, height: float, floor: float, uneven: Callable[[str, Array], float]
) -> list[Expectation]:
    """Joints of trunk and limbs that deviate from proportions, the midline or the other side.

    Args:
        joints: Canonical joints → positions [m].
        up: The body's up direction, unit vector.
        height: Height of its surface along ``up`` [m].
        floor: Lowest coordinate of its surface along ``up`` [m].
        uneven: Asymmetry of the flesh around a joint's place, from 0 to 1, and the share of its segments outside.
    """
    pairs = left_and_right(joints)
    if len(pairs) < FEWEST_PAIRS:
        return []
    left, middle, alike = sagittal_plane(pairs, height)
    out = _limbs(joints)
    out += _spine(joints, up, height, left, middle)
    named = {expectation.joint for expectation in out}
    if not alike:
        return out
    for name, (a, b) in pairs.items():
        mirrored = b - 2.0 * float((b - middle) @ left) * left
        off = float(np.linalg.norm(a - mirrored))
        fine = name.partition(".")[0] in (*DIGITS, "wrist") or name.startswith(("toe", "ball", "heel"))
        if off <= (_HAND_ASIDE if fine else _ASIDE) * height or {f"left.{name}", f"right.{name}"} & named:
            continue
        odd = {
            side: uneven(f"{side}.{name}", place) + _oddity(name, place, joints, side, left, middle, up, height, floor)
            for side, place in (("left", a), ("right", b))
        }
        ratio = odd["left"] / max(odd["right"], 1e-9)
        # where neither side is clearly the wrong one, both are reported
        doubted = [side for side, r in (("left", ratio), ("right", 1.0 / max(ratio, 1e-9))) if r > 1.0 / _CLEARLY]
        for side in doubted:
            place = mirrored if side == "left" else a - 2.0 * float((a - middle) @ left) * left
            beside = f"the other side's is {1e3 * off:.0f} mm elsewhere"
            beside += "; either may be wrong" if len(doubted) > 1 else ""
            out.append(Expectation(f"{side}.{name}", "asymmetric", place, off, beside))
    return out


def _oddity(
    name: str,
    place: Array,
    joints: Joints,
    side: str,
    left: Array,
    middle: Array,
    up: Array,
    height: float,
    floor: float,
) -> float:
    """How unusual a joint's position is: by body proportions, or by length differences and bends of its bones."""
    if name in _USUAL:
        aside, high = _USUAL[name]
        off = np.hypot(abs((place - middle) @ left) / height - aside, ((place @ up) - floor) / height - high)
        return float(_SCALE * off / _ASIDE)
    for limb in _LIMBS:
        if name in limb:
            a, b, c = (joints.get(f"{side}.{joint}") for joint in limb)
            if a is not None and b is not None and c is not None:
                halves = np.linalg.norm(b - a), np.linalg.norm(c - b)
                bent = 1.0 - float(unit(b - a) @ unit(c - b))
                return float(abs(np.log(halves[0] / halves[1])) + bent)
    chain = _chain_of(name)
    bones = [joints[f"{side}.{joint}"] for joint in chain if f"{side}.{joint}" in joints]
    if len(bones) > 2:
        ways = [unit(b - a) for a, b in pairwise(bones) if np.linalg.norm(b - a) > 0]
        lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(bones)]
        return float(sum(1.0 - v @ w for v, w in pairwise(ways)) + np.std(np.log(np.maximum(lengths, 1e-9))))
    return float(np.linalg.norm(place - middle) / height)


def _chain_of(name: str) -> list[str]:
    digit = name.partition(".")[0]
    if digit in DIGITS:
        return ["wrist", *(f"{digit}.{joint}" for joint in ("carpometacarpal", *FINGER_JOINTS))]
    if digit.startswith("toe"):
        return ["ankle", *(f"{digit}.{joint}" for joint in FINGER_JOINTS)]
    return ["ankle", "ball", "toe.tip"] if digit in ("ball", "toe") else []


def _limbs(joints: Joints) -> list[Expectation]:
    out = []
    for first, second, end in _LIMBS:
        for side in ("left", "right"):
            a, b, c = (joints.get(f"{side}.{name}") for name in (first, second, end))
            if a is None or b is None or c is None:
                continue
            upper, lower = float(np.linalg.norm(b - a)), float(np.linalg.norm(c - b))
            if min(upper, lower) <= 0.0 or max(upper, lower) < _HALVES * min(upper, lower):
                continue
            # the joint moves along the longer half until both are equal
            off = abs(upper - lower) / 2
            place = b + off * (unit(a - b) if upper > lower else unit(c - b))
            parts = ("thigh", "shin") if first == "hip" else ("upper arm", "forearm")
            out.append(
                Expectation(
                    f"{side}.{second}",
                    "proportion",
                    place,
                    off,
                    f"{parts[0]} {1e3 * upper:.0f} mm, {parts[1]} {1e3 * lower:.0f}",
                    float(abs(np.log(upper / lower)) / np.log(_HALVES)),
                )
            )
    return out


def _spine(joints: Joints, up: Array, height: float, left: Array, middle: Array) -> list[Expectation]:
    names = [n for n in ("pelvis", *sorted(n for n in joints if n.startswith("spine"))) if n in joints]
    # joints of a neck with several are closer together: only the first of them ends the spine's sequence
    necks = sorted(n for n in joints if n.startswith("neck"))
    names += [n for n in ((*necks, "head") if len(necks) == 1 else (*necks[:1], "head")[:1]) if n in joints]
    places = {name: joints[name] for name in names}
    out = []
    for name in dict.fromkeys((*names, *necks, *(n for n in ("head", "head.top") if n in joints))):
        aside = float((joints[name] - middle) @ left)
        if abs(aside) > _ASIDE * height:
            place = joints[name] - aside * left
            places[name] = place
            out.append(
                Expectation(name, "midline", place, abs(aside), f"{1e3 * abs(aside):.0f} mm off the body's midline")
            )
    while True:
        wrong = _misplaced_along_spine(names, places, up)
        if not wrong:
            return out
        tried = {name: len(_misplaced_along_spine(names, {**places, name: place}, up)) for name, place in wrong.items()}
        name = min(tried, key=lambda n: (tried[n], -float(np.linalg.norm(places[n] - wrong[n]))))
        off = float(np.linalg.norm(joints[name] - wrong[name]))
        places[name] = wrong[name]
        out.append(Expectation(name, "proportion", wrong[name], off, "not between its neighbours along the spine"))
        if len(out) > len(names):
            return out


def _misplaced_along_spine(names: list[str], places: Joints, up: Array) -> dict[str, Array]:
    """Joints of the spine that are not about half-way between their neighbours, and their expected positions."""
    out = {}
    for below, name, above in zip(names, names[1:], names[2:], strict=False):
        low, here, high = (float(places[n] @ up) for n in (below, name, above))
        share = (here - low) / (high - low) if high > low else np.inf
        if not _BETWEEN[0] <= share <= _BETWEEN[1]:
            place = places[name] + (low + _MIDDLE * (high - low) - here) * up
            out[name] = place
    return out
