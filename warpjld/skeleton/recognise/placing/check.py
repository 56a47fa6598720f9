"""Detection of misplaced joints (R14), which cause bad deformation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.coincident import close_pairs
from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.placing.digit_flesh import InFlesh, digits_in_flesh
from warpjld.skeleton.recognise.placing.expected import body_expectations
from warpjld.skeleton.recognise.placing.expected_digits import finger_expectations
from warpjld.skeleton.recognise.placing.finding import Finding, millimetres, one_per_joint
from warpjld.skeleton.recognise.placing.inside import held_inside, open_ends
from warpjld.skeleton.recognise.placing.sections import check_in_flesh, check_sections, check_segments
from warpjld.skeleton.recognise.placing.symmetry import without_shared
from warpjld.skeleton.recognise.placing.trunk import body_frame, check_crown, check_spine
from warpjld.skeleton.recognise.section import cross_section, first_hits, skin_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["check_placing"]

_END = 0.5  # largest distance of a root before the surface's end, per radius there: ends may be hollow, as sleeves are


def check_placing(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[Finding, ...]:
    """Check every joint and segment against the surface.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3), anticlockwise seen from outside.
    """
    findings = _check_coincident(skeleton, vertices)
    ends = open_ends(vertices, faces)
    inside = held_inside(vertices, faces, skeleton.rest, ends)
    for j in np.flatnonzero(~inside & ~_before_the_surface(skeleton, vertices, faces)):
        back = millimetres(_displacement_inside(skeleton, vertices[np.unique(faces)], int(j)))
        findings.append(Finding(skeleton.names[j], "outside", 1.0, "", back))
    segments = check_segments(skeleton, vertices, faces, inside, ends)
    findings += segments
    flesh = digits_in_flesh(skeleton, vertices, faces)
    flesh = {name: one for name, one in flesh.items() if inside[skeleton.index(name)]}
    findings += check_in_flesh(flesh)
    findings += check_sections(skeleton, vertices, faces, inside)
    findings += check_spine(skeleton, vertices, faces, inside)
    findings += _check_expected(skeleton, vertices, faces, flesh, _leaving(skeleton, segments))
    findings += check_crown(skeleton, vertices, faces)
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    findings = without_shared(findings, joints, float(np.ptp(vertices, axis=0).max()))
    return tuple(one_per_joint(findings))


def _before_the_surface(
    skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Mask of roots from which the bones enter the surface through an end nearby, as from a wrist at the hand's end."""
    out = np.zeros(len(skeleton), dtype=bool)
    for root in np.flatnonzero(skeleton.parents < 0):
        place, below = skeleton.rest[root], list(skeleton.children[root])
        way = skeleton.rest[below].mean(axis=0) - place if below else np.zeros(3)
        if not way.any():
            continue
        way = unit(way)
        gap = float(first_hits(vertices, faces, place[None], way[None])[0])
        section = cross_section(vertices, faces, place + 2.0 * gap * way, way) if np.isfinite(gap) else None
        out[root] = section is not None and gap < _END * section.radius
    return out


def _displacement_inside(skeleton: Skeleton, vertices: NDArray[np.float64], joint: int) -> NDArray[np.float64]:
    """Displacement of a joint from outside into the surface: a spine joint to between its neighbours, others past the
    nearest vertex."""
    place = skeleton.rest[joint]
    above, below = int(skeleton.parents[joint]), skeleton.children[joint]
    if skeleton.names[joint].startswith(("spine", "neck")) and above >= 0 and below:
        low = skeleton.rest[above]
        way = skeleton.rest[below[0]] - low
        share = float(np.clip((place - low) @ way / max(float(way @ way), 1e-30), 0.25, 0.75))
        return np.asarray(low + share * way - place)
    nearest = vertices[int(((vertices - place) ** 2).sum(axis=1).argmin())]
    inwards = nearest - place
    length = float(np.linalg.norm(inwards))
    return np.asarray(inwards * (1.0 + 0.01 / max(length, 0.01)))


def _leaving(skeleton: Skeleton, segments: list[Finding]) -> dict[str, float]:
    """Joints at either end of a segment that leaves the surface → its largest share outside."""
    out: dict[str, float] = {}
    for one in segments:
        above = int(skeleton.parents[skeleton.index(one.joint)])
        ends = [one.joint] + [skeleton.names[above]] * (one.kind == "leaves" and above >= 0)
        out |= {name: max(one.amount, out.get(name, 0.0)) for name in ends}
    return out


def _check_expected(
    skeleton: Skeleton,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    flesh: Mapping[str, InFlesh],
    leaving: Mapping[str, float],
) -> list[Finding]:
    """Joints that deviate from comparable joints of the same body."""
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    # a misplaced tip would make the joints before it look misplaced
    tips = {name: joints[name] + one.offset for name, one in flesh.items() if one.ahead and one.deviation > 1.0}
    aside = {name: one.deviation for name, one in flesh.items() if one.ahead is None}
    found = finger_expectations(joints | tips, aside)
    up, _ = body_frame(joints)
    if up is not None:
        high = vertices[np.unique(faces)] @ up

        def uneven(name: str, place: NDArray[np.float64]) -> float:
            rays = np.concatenate([np.eye(3), -np.eye(3)])
            reach = skin_hits(vertices, faces, np.repeat(place[None], 6, axis=0), rays)
            a, b = reach[:3], reach[3:]
            known = np.isfinite(a) & np.isfinite(b)
            share = np.ones(3)
            share[known] = np.abs(a[known] - b[known]) / (a[known] + b[known])
            return float(share.mean()) + leaving.get(name, 0.0)

        found += body_expectations(joints, up, float(np.ptp(high)), float(high.min()), uneven)
    return [
        Finding(one.joint, one.kind, one.amount, one.detail, millimetres(one.place - joints[one.joint]), one.excess)
        for one in found
    ]


def _check_coincident(skeleton: Skeleton, vertices: NDArray[np.float64]) -> list[Finding]:
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    pairs = close_pairs(skeleton.rest, 1e-3 * size)
    out = []
    for a, b in sorted(map(tuple, pairs)):
        if skeleton.parents[a] == skeleton.parents[b]:  # several bones may begin at one place
            continue
        gap = float(np.linalg.norm(skeleton.rest[a] - skeleton.rest[b]))
        out.append(Finding(skeleton.names[b], "coincident", gap, f"{skeleton.names[a]}, {1e3 * gap:.1f} mm apart"))
    return out
