"""Expected positions of the joints of digits (R14).

A finger's joint lies where those of the other fingers do, in proportion (Buryanov, Kotiuk 2010), and its middle joint
where the surface is widest, if that can be seen: both estimates are averaged. Thumbs are compared with themselves.
Tolerances are the largest deviations found in existing rigs.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.recognise.placing.expected import Expectation

__all__ = ["finger_expectations"]

Array = NDArray[np.float64]
Joints = Mapping[str, Array]

# mean lengths of the phalanges to the tip's centre, and from the wrist to the base [mm] (Buryanov, Kotiuk 2010)
_PHALANGES = {
    "index": (39.8, 22.4, 15.0),
    "middle": (44.6, 26.3, 16.5),
    "ring": (41.4, 25.7, 16.5),
    "pinky": (32.7, 18.1, 14.5),
}
_TO_BASE = {"index": 98.0, "middle": 95.0, "ring": 89.0, "pinky": 84.0}
_ALONG = 0.045  # tolerance for a finger's joint against the other fingers, per length of the palm
_THUMB = (0.51, 0.65)  # usual place of second and third joint between their neighbours, as a share
_THUMB_ALONG = 0.08  # tolerance for them, per length of both bones


def finger_expectations(
    joints: Joints, widest: Mapping[str, float], aside: Mapping[str, float] = MappingProxyType({})
) -> list[Expectation]:
    """Joints of digits whose relative position differs from that of the other digits, and from the surface.

    Args:
        joints: Canonical joints → positions [m].
        widest: Middle joints → distance to the finger's widest section [m], as of ``widest_at_knuckles``.
        aside: Deviations across the bone in units of their tolerance, which leave less for one along the bone.
    """
    out: list[Expectation] = []
    for side in ("left.", "right.", ""):
        chains = {
            digit: [joints[f"{side}{digit}.{joint}"] for joint in FINGER_JOINTS]
            for digit in _PHALANGES
            if all(f"{side}{digit}.{joint}" in joints for joint in FINGER_JOINTS)
        }
        wrist = joints.get(f"{side}wrist")
        if len(chains) < 4 or wrist is None:
            continue
        palms = {digit: float(np.linalg.norm(chain[0] - wrist)) for digit, chain in chains.items()}
        relative = {digit: palms[digit] / _TO_BASE[digit] for digit in chains}
        palm = float(np.median(list(relative.values()))) * _TO_BASE["middle"]
        bases = _bases(side, chains, palms, palm)
        # several together: the wrist is elsewhere or the hand has other proportions, which says nothing of the bases
        bases = bases if len(bases) == 1 else {}
        wrong = set(bases)
        out += bases.values()
        out += _thumb(side, joints, aside)
        out += _knuckles(side, {d: c for d, c in chains.items() if d not in wrong}, palm, widest, aside)
    return out


def _bases(
    side: str, chains: Mapping[str, list[Array]], palms: Mapping[str, float], palm: float
) -> dict[str, Expectation]:
    """Fingers whose base is at another distance from the wrist than the others', in proportion."""
    out = {}
    relative = {digit: palms[digit] / _TO_BASE[digit] for digit in chains}
    for digit, chain in chains.items():
        others = np.median([relative[d] for d in chains if d != digit])
        off = float((relative[digit] - others) * _TO_BASE[digit])
        if abs(off) > _ALONG * palm:
            out[digit] = Expectation(
                f"{side}{digit}.base",
                "proportion",
                chain[0] - off * unit(chain[1] - chain[0]),
                abs(off),
                f"{1e3 * palms[digit]:.0f} mm from the wrist, beside the other fingers "
                f"{1e3 * (palms[digit] - off):.0f} are expected",
                abs(off) / (_ALONG * palm),
            )
    return out


def _tolerated(aside: Mapping[str, float], name: str) -> float:
    """Share of the tolerance along the bone that a deviation across it leaves."""
    return float(np.sqrt(1.0 - min(aside.get(name, 0.0), 1.0) ** 2))


def _thumb(side: str, joints: Joints, aside: Mapping[str, float]) -> list[Expectation]:
    """The joint of a thumb whose displacement explains most; a thumb has no comparable neighbour."""
    names = [f"{side}thumb.{joint}" for joint in FINGER_JOINTS]
    if not all(name in joints for name in names):
        return []
    chain = np.array([joints[name] for name in names])
    off, most = _thumb_deviations(chain)
    tried = []
    for k in (1, 2):
        if abs(off[k - 1]) > most[k - 1] * _tolerated(aside, names[k]):
            moved = chain.copy()
            moved[k] += abs(off[k - 1]) * unit(chain[k - 1] - chain[k] if off[k - 1] > 0 else chain[k + 1] - chain[k])
            left, _ = _thumb_deviations(moved)
            tried.append((float(np.abs(left).sum()), k, moved[k]))
    if not tried:
        return []
    _, k, place = min(tried, key=lambda one: one[:2])
    first, second = (1e3 * float(length) for length in _bones(chain)[k - 1 : k + 1])
    detail = f"{first:.1f} mm before it, {second:.1f} behind"
    by = abs(float(off[k - 1]))
    return [Expectation(names[k], "proportion", place, by, detail, by / float(most[k - 1]))]


def _thumb_deviations(chain: Array) -> tuple[Array, Array]:
    """How far second and third joint of a thumb (4, 3) are too far out [m], and their tolerances, shapes (2,)."""
    bones = _bones(chain)
    both = bones[:2] + bones[1:]
    return bones[:2] - np.array(_THUMB) * both, _THUMB_ALONG * both


def _bones(chain: Array) -> Array:
    return np.asarray(np.linalg.norm(np.diff(chain, axis=0), axis=1))


def _knuckles(
    side: str,
    chains: Mapping[str, list[Array]],
    palm: float,
    widest: Mapping[str, float],
    aside: Mapping[str, float],
) -> list[Expectation]:
    if len(chains) < 3:
        return []
    found: list[Expectation] = []
    shares, lengths = {}, {}
    for digit, chain in chains.items():
        bones = _bones(np.array(chain))
        usual = np.cumsum(_PHALANGES[digit]) / sum(_PHALANGES[digit])
        lengths[digit] = float(bones.sum())
        shares[digit] = (np.cumsum(bones) / bones.sum() - usual)[:2]
    for digit, chain in chains.items():
        others = np.median([shares[d] for d in chains if d != digit], axis=0)
        off = (shares[digit] - others) * lengths[digit]
        if (seen := widest.get(f"{side}{digit}.{FINGER_JOINTS[1]}")) is not None:
            off[0] = 0.5 * (off[0] - seen)
        names = [f"{side}{digit}.{joint}" for joint in FINGER_JOINTS[1:3]]
        excess = np.abs(off) / (_ALONG * palm)
        k = int(np.argmax(excess / [max(_tolerated(aside, name), 1e-9) for name in names]))
        if excess[k] <= _tolerated(aside, names[k]):
            continue
        before, at, after = chain[k], chain[k + 1], chain[k + 2]
        way = unit(before - at) if off[k] > 0 else unit(after - at)
        found.append(
            Expectation(
                names[k],
                "proportion",
                at + abs(float(off[k])) * way,
                abs(float(off[k])),
                f"{abs(1e3 * float(off[k])):.1f} mm too far {'out' if off[k] > 0 else 'in'} beside the other fingers",
                float(excess[k]),
            )
        )
    return found
