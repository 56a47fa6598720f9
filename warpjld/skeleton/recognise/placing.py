"""Suspicious joint placing (R14): a joint that is not where joints belong is what deforms badly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.coincident import close_pairs, connected_parts
from warpjld.skeleton.recognise.section import first_hits
from warpjld.skeleton.tree import Skeleton
from warpjld.winding import winding_numbers

__all__ = ["Finding", "check_placing", "in_trunk", "outside_surface"]

_OFF_CENTRE = 0.5  # |a − b| / (a + b) of the flesh on both sides: at 0.5 one side is three times the other
_NARROW = 1.6  # a section wider than this times its depth is judged by its depth alone (palms)
_PAD = (0.4, 2.5)  # flesh beyond an extremity per half thickness there: 1 in the centre of a round end
_SAMPLES = 5
# trunk joints follow the spine, which lies at the back: off-centre is where they belong
_WORDS = {
    "outside": "lies outside the surface",
    "off-centre": "is off-centre",
    "coincident": "shares its place with another joint",
    "leaves": "ends a segment that leaves the surface",
    "extremity": "is not at the centre of its extremity",
}
_TRUNK = ("pelvis", "spine", "neck", "head", "clavicle", "shoulder", "hip", "top")


@dataclass(frozen=True)
class Finding:
    """One doubtful placing.

    Attributes:
        joint: The joint, or the far end of the segment.
        kind: ``outside``, ``off-centre``, ``coincident``, ``leaves`` or ``extremity``.
        amount: How far: a distance [m] for ``coincident``, else a ratio.
        detail: What was measured, for people; may be empty.
    """

    joint: str
    kind: str
    amount: float
    detail: str = ""

    @property
    def message(self) -> str:
        """One line for people."""
        return f"{self.joint} {_WORDS[self.kind]}" + (f": {self.detail}" if self.detail else "")


def check_placing(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[Finding, ...]:
    """Check every joint and segment against the surface.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3), anticlockwise seen from outside.
    """
    findings = _coincident(skeleton, vertices)
    ends = _open_ends(vertices, faces)
    inside = _inside(vertices, faces, skeleton.rest, ends)
    findings += [Finding(skeleton.names[j], "outside", 1.0) for j in np.flatnonzero(~inside)]
    findings += _leaving(skeleton, vertices, faces, inside, ends)
    findings += _sections(skeleton, vertices, faces, inside)
    return tuple(findings)


def _coincident(skeleton: Skeleton, vertices: NDArray[np.float64]) -> list[Finding]:
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    pairs = close_pairs(skeleton.rest, 1e-3 * size)
    out = []
    for a, b in sorted(map(tuple, pairs)):
        gap = float(np.linalg.norm(skeleton.rest[a] - skeleton.rest[b]))
        out.append(Finding(skeleton.names[b], "coincident", gap, f"{skeleton.names[a]}, {1e3 * gap:.1f} mm apart"))
    return out


def _open_ends(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> list[tuple[NDArray[np.float64], float]]:
    """Centre and radius of every hole's rim: wrists may be cut open there."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = unique[count == 1]
    if not len(rim):
        return []
    label = connected_parts(rim, len(vertices))
    out = []
    for loop in np.unique(label[rim[:, 0]]):
        points = vertices[label == loop]
        centre = points.mean(axis=0)
        out.append((centre, float(np.linalg.norm(points - centre, axis=1).max())))
    return out


def outside_surface(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], points: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which points lie outside a surface that may be open at its ends, shape (n,)."""
    return ~_inside(vertices, faces, points, _open_ends(vertices, faces))


def _inside(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    points: NDArray[np.float64],
    ends: list[tuple[NDArray[np.float64], float]],
) -> NDArray[np.bool_]:
    """Inside the surface, or in the mouth of an open end, where a winding number fades to one half."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    inside = winding_numbers(vertices, faces, points) > 0.5
    for centre, radius in ends:
        inside |= np.linalg.norm(points - centre, axis=1) < 0.7 * radius
    return inside


def _leaving(
    skeleton: Skeleton,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    inside: NDArray[np.bool_],
    ends: list[tuple[NDArray[np.float64], float]],
) -> list[Finding]:
    segments = [s for s in skeleton.segments if inside[s.proximal] and inside[s.distal]]
    share = np.linspace(0, 1, _SAMPLES + 2)[1:-1, None]
    samples = [skeleton.rest[s.proximal] * (1 - share) + skeleton.rest[s.distal] * share for s in segments]
    if not samples:
        return []
    held = _inside(vertices, faces, np.concatenate(samples), ends).reshape(len(segments), _SAMPLES)
    out = []
    for segment, row in zip(segments, held, strict=True):
        if not row.all():
            outside = 1.0 - float(row.mean())
            detail = f"{outside:.0%} of the segment from {skeleton.names[segment.proximal]}"
            out.append(Finding(skeleton.names[segment.distal], "leaves", outside, detail))
    return out


def _sections(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32], inside: NDArray[np.bool_]
) -> list[Finding]:
    """Flesh on the four sides of every joint, and beyond every extremity."""
    joints = [j for j in np.flatnonzero(inside) if not in_trunk(skeleton.names[j])]
    if not joints:
        return []
    bone, axis = skeleton.directions[joints], skeleton.axes[joints]
    normal = np.cross(bone, axis)
    rays = np.stack([normal, -normal, axis, -axis, bone], axis=1)
    origins = np.repeat(skeleton.rest[joints], 5, axis=0)
    reach = first_hits(vertices, faces, origins, rays.reshape(-1, 3)).reshape(-1, 5)
    out = []
    for j, (up, down, left, right, ahead) in zip(joints, reach, strict=True):
        name = skeleton.names[j]
        ratios = []
        for a, b, side in ((up, down, ("back", "front")), (left, right, ("one side", "other side"))):
            if np.isfinite(a) and np.isfinite(b) and a + b <= _NARROW * min(up + down, left + right):
                ratios.append((abs(a - b) / (a + b), a, b, side))
        if ratios and (worst := max(ratios))[0] > _OFF_CENTRE:
            amount, a, b, (first, second) = worst
            detail = f"{1e3 * a:.1f} mm of flesh at the {first}, {1e3 * b:.1f} at the {second}"
            out.append(Finding(name, "off-centre", float(amount), detail))
        half = min(up + down, left + right) / 2
        if not skeleton.children[j] and np.isfinite([ahead, half]).all():
            pad = ahead / half
            if not _PAD[0] <= pad <= _PAD[1]:
                detail = f"{1e3 * ahead:.1f} mm of flesh beyond, {1e3 * half:.1f} around"
                out.append(Finding(name, "extremity", float(pad), detail))
    return out


def in_trunk(name: str) -> bool:
    """Whether a joint of this canonical name is the trunk's, hips and shoulders among them."""
    return name.rpartition(".")[2].rstrip("0123456789") in _TRUNK
