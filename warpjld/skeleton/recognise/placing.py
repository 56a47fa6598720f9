"""Detection of misplaced joints (R14), which cause bad deformation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.coincident import close_pairs, connected_parts
from warpjld.geometry.winding import winding_numbers
from warpjld.skeleton.digits import is_digit
from warpjld.skeleton.recognise.complete_body import find_extremities
from warpjld.skeleton.recognise.expected import body_expectations
from warpjld.skeleton.recognise.expected_digits import finger_expectations
from warpjld.skeleton.recognise.knuckle_width import widest_at_knuckles
from warpjld.skeleton.recognise.section import first_hits
from warpjld.skeleton.tree import Skeleton

__all__ = ["Finding", "check_placing", "in_trunk", "outside_surface"]

_OFF_CENTRE = 0.5  # |a − b| / (a + b) of the flesh on both sides: at 0.5 one side is three times the other
_NARROW = 1.6  # sections wider than this times their depth are judged by depth alone (palms)
_PAD = (0.4, 2.5)  # range of flesh beyond an extremity per half thickness there: 1 in the centre of a round end
_SAMPLES = 5  # samples of a segment
# trunk joints follow the spine, which lies towards the back, so that they are off-centre by nature
_DIGIT = (0.06, 0.66)
"""Range of the place of a digit's joints, as a share of the flesh from the back: bones run close to the back's skin,
the pad lies below. Existing rigs have toes at .08, knuckles at .2 to .5."""
_CROWN = 0.02  # tolerance of the head's extremity, per height of the body: about half a head's radius
_SPINE_AT = 0.3  # proposed place of a spine joint, per depth of the trunk from its back
_SPINE = (0.07, 0.56)
"""Range of the place of spine joints, per depth of the trunk from its back: .15 to .46 in existing rigs."""

_WORDS = {
    "proportion": "is misplaced along its limb",
    "asymmetric": "is not where the other side's joint is",
    "midline": "is off the midline",
    "outside": "lies outside the surface",
    "off-centre": "is off-centre",
    "coincident": "shares its place with another joint",
    "leaves": "ends a segment that leaves the surface",
    "extremity": "is not at the centre of its extremity",
}
_TRUNK = ("pelvis", "spine", "neck", "head", "clavicle", "shoulder", "hip", "top")


@dataclass(frozen=True)
class Finding:
    """A suspicious joint position.

    Attributes:
        joint: The joint, or the far end of the segment.
        kind: ``outside``, ``off-centre``, ``coincident``, ``leaves``, ``extremity``, ``proportion``, ``asymmetric`` or
            ``midline``.
        amount: Size of the deviation: a distance [m] for ``coincident``, else a ratio.
        detail: Description of the measurement for the user; may be empty.
        proposal: Displacement to the expected position [mm], or None if that is unknown.
    """

    joint: str
    kind: str
    amount: float
    detail: str = ""
    proposal: tuple[float, float, float] | None = None

    @property
    def message(self) -> str:
        """One line for the user."""
        text = f"{self.joint} {_WORDS[self.kind]}" + (f": {self.detail}" if self.detail else "")
        if self.proposal is None:
            return text
        x, y, z = self.proposal
        length = float(np.linalg.norm(self.proposal))
        return f"{text}; proposed: move it {length:.1f} mm, by ({x:+.1f}, {y:+.1f}, {z:+.1f}) mm"


def check_placing(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[Finding, ...]:
    """Check every joint and segment against the surface.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3), anticlockwise seen from outside.
    """
    findings = _check_coincident(skeleton, vertices)
    ends = _open_ends(vertices, faces)
    inside = _inside(vertices, faces, skeleton.rest, ends)
    for j in np.flatnonzero(~inside):
        back = _millimetres(_displacement_inside(skeleton, vertices[np.unique(faces)], int(j)))
        findings.append(Finding(skeleton.names[j], "outside", 1.0, "", back))
    findings += _check_segments(skeleton, vertices, faces, inside, ends)
    findings += _check_sections(skeleton, vertices, faces, inside)
    findings += _check_spine(skeleton, vertices, faces, inside)
    findings += _check_expected(skeleton, vertices, faces)
    findings += _check_crown(skeleton, vertices, faces)
    return tuple(_one_per_joint(findings))


def _one_per_joint(findings: list[Finding]) -> list[Finding]:
    """One finding per joint: the first, completed by the first proposal found for that joint.

    Of a joint outside, the nearest place inside is proposed only where nothing else says where it belongs."""
    best: dict[str, Finding] = {}
    for one in findings:
        had = best.get(one.joint)
        if had is None:
            best[one.joint] = one
        elif one.proposal is None or had.kind == "coincident":
            continue
        elif had.proposal is None or (had.kind == "outside" and one.kind in ("proportion", "asymmetric", "midline")):
            detail = ", ".join(part for part in (had.detail, one.detail) if part)
            best[one.joint] = replace(had, proposal=one.proposal, detail=detail)
    return list(best.values())


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


def _check_crown(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> list[Finding]:
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
    return [Finding("head.top", "extremity", off, detail, _millimetres(offset))]


def _millimetres(offset: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (round(1e3 * float(part), 2) for part in offset)
    return x, y, z


def _check_expected(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> list[Finding]:
    """Joints that deviate from comparable joints of the same body."""
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    found = finger_expectations(joints, widest_at_knuckles(skeleton, vertices, faces))
    up, _ = body_frame(joints)
    if up is not None:
        high = vertices[np.unique(faces)] @ up

        def uneven(place: NDArray[np.float64]) -> float:
            rays = np.concatenate([np.eye(3), -np.eye(3)])
            reach = first_hits(vertices, faces, np.repeat(place[None], 6, axis=0), rays)
            a, b = reach[:3], reach[3:]
            known = np.isfinite(a) & np.isfinite(b)
            share = np.ones(3)
            share[known] = np.abs(a[known] - b[known]) / (a[known] + b[known])
            return float(share.mean())

        found += body_expectations(joints, up, float(np.ptp(high)), float(high.min()), uneven)
    return [
        Finding(one.joint, one.kind, one.amount, one.detail, _millimetres(one.place - joints[one.joint]))
        for one in found
    ]


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


def _check_spine(
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
    reach = first_hits(vertices, faces, origins, rays).reshape(-1, 2)
    out = []
    for name, (back, front) in zip(names, reach, strict=True):
        whole = back + front
        if np.isfinite(whole) and not _SPINE[0] <= back / whole <= _SPINE[1]:
            detail = f"{1e3 * back:.0f} mm of flesh at the back, {1e3 * front:.0f} at the front"
            offset = (_SPINE_AT * whole - back) * forward
            out.append(Finding(name, "off-centre", float(back / whole), detail, _millimetres(offset)))
    return out


def _check_coincident(skeleton: Skeleton, vertices: NDArray[np.float64]) -> list[Finding]:
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    pairs = close_pairs(skeleton.rest, 1e-3 * size)
    out = []
    for a, b in sorted(map(tuple, pairs)):
        gap = float(np.linalg.norm(skeleton.rest[a] - skeleton.rest[b]))
        out.append(Finding(skeleton.names[b], "coincident", gap, f"{skeleton.names[a]}, {1e3 * gap:.1f} mm apart"))
    return out


def _open_ends(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> list[tuple[NDArray[np.float64], float]]:
    """Centre and radius of every boundary loop: wrists may be cut open there."""
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
    """Mask of points outside a surface that may be open at its ends, shape (n,)."""
    return ~_inside(vertices, faces, points, _open_ends(vertices, faces))


def _inside(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    points: NDArray[np.float64],
    ends: list[tuple[NDArray[np.float64], float]],
) -> NDArray[np.bool_]:
    """Whether points are inside the surface, or near an open end, where the winding number fades to one half."""
    if not len(points):
        return np.zeros(0, dtype=bool)
    inside = winding_numbers(vertices, faces, points) > 0.5
    for centre, radius in ends:
        inside |= np.linalg.norm(points - centre, axis=1) < 0.7 * radius
    return inside


def _check_segments(
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


def _check_sections(
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
    reach = first_hits(vertices, faces, origins, rays.reshape(-1, 3)).reshape(-1, 5)
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
            out.append(Finding(name, "off-centre", float(amount), detail, _millimetres((a - b) / 2 * side)))
        half = min(up + down, left + right) / 2
        if not skeleton.children[j] and np.isfinite([ahead, half]).all():
            pad = ahead / half
            if not _PAD[0] <= pad <= _PAD[1]:
                detail = f"{1e3 * ahead:.1f} mm of flesh beyond, {1e3 * half:.1f} around"
                offset = (ahead - half) * bone[k]
                out.append(Finding(name, "extremity", float(pad), detail, _millimetres(offset)))
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
    return [Finding(name, "off-centre", float(back / whole), detail, _millimetres(offset))]


def in_trunk(name: str) -> bool:
    """Whether a joint of this canonical name belongs to the trunk, including hips and shoulders."""
    return name.rpartition(".")[2].rstrip("0123456789") in _TRUNK
