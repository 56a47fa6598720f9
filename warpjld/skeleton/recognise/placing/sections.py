"""Joints and segments too near to the surface or outside it (R14)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.digits import is_digit
from warpjld.skeleton.recognise.placing.digit_flesh import InFlesh
from warpjld.skeleton.recognise.placing.finding import Finding, millimetres
from warpjld.skeleton.recognise.placing.inside import held_inside
from warpjld.skeleton.recognise.section import skin_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["check_in_flesh", "check_sections", "check_segments", "in_trunk"]

_OFF_CENTRE = 0.5  # |a − b| / (a + b) of the flesh on both sides: at 0.5 one side is three times the other
_NARROW = 1.6  # sections wider than this times their depth are judged by depth alone (palms)
_PAD = (0.4, 2.5)  # range of flesh beyond an extremity per half thickness there: 1 in the centre of a round end
_SAMPLES = 5  # samples of a segment
_DIGIT = (0.06, 0.66)
"""Range of the place of a digit's joints, as a share of the flesh from the back: bones run close to the back's skin,
the pad lies below. Existing rigs have toes at .08, knuckles at .2 to .5."""
_TRUNK = ("pelvis", "spine", "neck", "head", "clavicle", "shoulder", "hip", "top")


def check_segments(
    skeleton: Skeleton,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    inside: NDArray[np.bool_],
    ends: list[tuple[NDArray[np.float64], float]],
) -> list[Finding]:
    """Segments of which a part is outside, although both of their joints are inside."""
    segments = [s for s in skeleton.segments if inside[s.proximal] and inside[s.distal]]
    share = np.linspace(0, 1, _SAMPLES + 2)[1:-1, None]
    samples = [skeleton.rest[s.proximal] * (1 - share) + skeleton.rest[s.distal] * share for s in segments]
    if not samples:
        return []
    held = held_inside(vertices, faces, np.concatenate(samples), ends).reshape(len(segments), _SAMPLES)
    leaving = {
        skeleton.names[segment.distal]: (skeleton.names[segment.proximal], 1.0 - float(row.mean()))
        for segment, row in zip(segments, held, strict=True)
        if not row.all()
    }
    begun = Counter(start for start, _ in leaving.values())
    out = []
    for start in (name for name, count in begun.items() if count > 1):
        # where several segments of a joint leave the surface, the joint is to blame rather than each of their ends
        far = [name for name, (begin, _) in leaving.items() if begin == start]
        most = max(leaving.pop(name)[1] for name in far)
        out.append(Finding(start, "begins", most, f"{most:.0%} of the segment to {far[0]}, and {len(far) - 1} more"))
    for name, (start, outside) in leaving.items():
        out.append(Finding(name, "leaves", outside, f"{outside:.0%} of the segment from {start}"))
    return out


def check_sections(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32], inside: NDArray[np.bool_]
) -> list[Finding]:
    """Check the flesh on the four sides of every joint, and beyond every extremity."""
    joints = [j for j in np.flatnonzero(inside) if not in_trunk(skeleton.names[j])]
    if not joints:
        return []
    bone, axis = skeleton.directions[joints], skeleton.axes[joints]
    normal = np.cross(bone, axis)
    rays = np.stack([normal, -normal, axis, -axis, bone], axis=1)
    origins = np.repeat(skeleton.rest[joints], 5, axis=0)
    reach = skin_hits(vertices, faces, origins, rays.reshape(-1, 3)).reshape(-1, 5)
    out = []
    for k, (j, (up, down, left, right, ahead)) in enumerate(zip(joints, reach, strict=True)):
        name = skeleton.names[j]
        digit = is_digit(name)
        if digit:
            out += _check_digit(name, bone[k], axis[k], up, down)
        ratios = []
        for a, b, side in ((up, down, ("back", "front")), (left, right, ("one side", "other side"))):
            if np.isfinite(a) and np.isfinite(b) and a + b <= _NARROW * min(up + down, left + right):
                ratios.append((abs(a - b) / (a + b), a, b, side))
        if not digit and ratios and (worst := max(ratios))[0] > _OFF_CENTRE:
            amount, a, b, (first, second) = worst
            detail = f"{1e3 * a:.1f} mm of flesh at the {first}, {1e3 * b:.1f} at the {second}"
            side = normal[k] if first == "back" else axis[k]
            out.append(Finding(name, "off-centre", float(amount), detail, millimetres((a - b) / 2 * side)))
        half = min(up + down, left + right) / 2
        if not skeleton.children[j] and np.isfinite([ahead, half]).all():
            pad = ahead / half
            if not _PAD[0] <= pad <= _PAD[1]:
                detail = f"{1e3 * ahead:.1f} mm of flesh beyond, {1e3 * half:.1f} around"
                offset = (ahead - half) * bone[k]
                out.append(Finding(name, "extremity", float(pad), detail, millimetres(offset)))
    return out


def check_in_flesh(flesh: Mapping[str, InFlesh]) -> list[Finding]:
    """Joints of fingers that are elsewhere in their flesh than those of the other fingers."""
    out = []
    for name, one in flesh.items():
        if one.deviation <= 1.0:
            continue
        back, front, side, other = (1e3 * flesh for flesh in one.sides)
        if one.aside or one.ahead is None:
            detail = (
                f"{back:.1f} mm of flesh at the back, {front:.1f} at the front, {side:.1f} and {other:.1f} at the sides"
            )
            kind = "off-centre"
        else:
            detail = f"{1e3 * one.ahead[0]:.1f} mm of flesh beyond, {1e3 * one.ahead[1]:.1f} are expected"
            kind = "extremity"
        out.append(Finding(name, kind, one.deviation, detail, millimetres(one.offset), one.deviation))
    return out


def _check_digit(
    name: str, bone: NDArray[np.float64], axis: NDArray[np.float64], back: float, front: float
) -> list[Finding]:
    """Check whether a digit's joint is too near to the digit's back or pad."""
    whole = back + front
    if not np.isfinite(whole) or name.endswith(("carpometacarpal", "thumb.base")):
        return []
    if _DIGIT[0] <= back / whole <= _DIGIT[1]:
        return []
    detail = f"{1e3 * back:.1f} mm of flesh at the back, {1e3 * front:.1f} at the front"
    offset = (back - 0.4 * whole) * np.cross(bone, axis)
    return [Finding(name, "off-centre", float(back / whole), detail, millimetres(offset))]


def in_trunk(name: str) -> bool:
    """Whether a joint of this canonical name belongs to the trunk, including hips and shoulders."""
    return name.rpartition(".")[2].rstrip("0123456789") in _TRUNK
