"""The covering formula in float64, one vertex at a time: an oracle that shares no code with what it checks.

Places are found from the skeleton, the parameters and a vertex's domain weights alone. Rotations become matrices as
soon as they are blended. Which column of the domains is which operator is the only thing asked of the covering.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering, Parameters
from warpjld.covering.binding import FLOOR, LATERAL, SIDE_BAND
from warpjld.covering.diffusion import BETA
from warpjld.covering.thinning import THRESHOLD
from warpjld.skeleton import CHANNELS, Poses, Skeleton

STATIONS = np.linspace(0.0, 1.0, 5)  # where along a palm pair its scale factor is evaluated
POWER_OFFSET = 0.05  # what keeps the slope of a^b finite


@dataclass
class Operator:
    """A vertex on one segment."""

    proximal: int
    distal: int
    muscle: bool
    weight: float
    ratio: float
    side: float


@dataclass
class Between:
    """A vertex between two palm segments that begin at joints a and b."""

    pair: int
    a: int
    b: int
    amount: float
    place: float


@dataclass
class Place:
    rest: np.ndarray
    operators: list[Operator]
    between: list[Between]


@dataclass
class Frame:
    """Inputs of one frame."""

    positions: np.ndarray
    halfway: np.ndarray
    rotations: np.ndarray
    ratio: np.ndarray
    closing: np.ndarray


@dataclass
class Row:
    """Coefficients of a vertex: of positions and both kinds of rotations (J each), roundings (J), the palm (N, 5) and
    muscles, by segment's ends."""

    rest: np.ndarray
    positions: np.ndarray
    halfway: np.ndarray
    bones: np.ndarray
    roundings: np.ndarray
    palm: np.ndarray
    muscles: np.ndarray
    swellings: np.ndarray


class Diffused:
    """The whole surface of a covering, so that its fields can be diffused."""

    def __init__(self, covering: Covering) -> None:
        self.skeleton = covering.skeleton
        self.swelling = covering.swelling  # what they are for has tests of its own
        self.thickening = covering.thickening
        self.ends = [(s.proximal, s.distal) for fan in covering.fans for s in fan.segments]
        self.pairs = [(a[0], b[0]) for a, b in palm_pairs(covering)]
        fans = [[(s.proximal, s.distal) for s in fan.segments] for fan in covering.fans]
        muscled = [fan.muscle for fan in covering.fans]
        surface = covering.surface
        self.places = [
            _place(self.skeleton, fans, muscled, vertex, domain, covering.parameters)
            for vertex, domain in zip(surface.vertices, covering.domains, strict=True)
        ]
        heat = _heat(surface.vertices, surface.faces, covering.diffusion.radius)
        found = covering.following  # what lies on what has tests of its own
        self.bends = heat if found is None else found.bending.toarray() @ heat
        self.heat = heat if found is None else found.follow.toarray() @ heat
        self._last: tuple[Parameters, list[int], list[Row]] | None = None  # other poses need no other rows

    def rows(self, vertices: list[int], parameters: Parameters) -> list[Row]:
        """Coefficients of vertices after diffusion and thinning."""
        before = [row_of(p, parameters, self.ends, len(self.pairs)) for p in self.places]
        names = ("positions", "halfway", "bones", "roundings", "palm", "muscles", "swellings")
        heat = {n: self.heat if n in ("positions", "halfway", "bones") else self.bends for n in names}
        after = {n: heat[n][vertices] @ np.array([getattr(r, n).ravel() for r in before]) for n in names}
        for n in ("positions", "roundings", "palm", "muscles", "swellings"):
            after[n] = np.array([_shrunk(row) for row in after[n]])
        for k in range(len(vertices)):
            after["positions"][k] /= after["positions"][k].sum()
            both = _shrunk(np.concatenate([after["halfway"][k], after["bones"][k]]))
            after["halfway"][k], after["bones"][k] = np.split(both / both.sum(), 2)
        after["palm"] = after["palm"].reshape(len(vertices), -1, len(STATIONS))
        return [Row(self.places[v].rest, *(after[n][k] for n in names)) for k, v in enumerate(vertices)]

    def points(self, vertices: list[int], frames: list[Frame], parameters: Parameters) -> np.ndarray:
        """Positions of vertices in every frame, shape (F, n, 3)."""
        if self._last is None or self._last[0] is not parameters or self._last[1] != vertices:
            self._last = parameters, list(vertices), self.rows(vertices, parameters)
        rows = self._last[2]
        return np.array([[self.point(r, f, parameters) for r in rows] for f in frames])

    def point(self, row: Row, frame: Frame, parameters: Parameters) -> np.ndarray:
        return evaluate(row, frame, parameters, self.swelling, self.thickening, self.skeleton, self.ends, self.pairs)


def row_of(place: Place, parameters: Parameters, ends: list[tuple[int, int]], pairs: int) -> Row:
    """What the operators give a vertex, for amplitudes of one."""
    joints = len(parameters.inflation)
    c, half, bone, rounding, swells = (np.zeros(joints) for _ in range(5))
    palm, muscles = np.zeros((pairs, len(STATIONS))), np.zeros(len(ends))
    for o in place.operators:
        p, d, t = o.proximal, o.distal, min(max(o.ratio, 0.0), 1.0)
        middle = min(max((o.ratio - 0.15) / 0.7, 0.0), 1.0)
        c[p] += o.weight * (1 - middle)
        c[d] += o.weight * middle
        swells[p] += o.weight * o.side * (1 - t**2 * (3 - 2 * t))
        swells[d] += o.weight * o.side * t**2 * (3 - 2 * t)
        prox_p, prox_d = parameters.proximity[p, 0], parameters.proximity[d, 1]
        in_p = 1 - t / prox_p if t < prox_p else 0.0  # area 1, 1 at the joint
        in_d = 1 - (1 - t) / prox_d if 1 - t < prox_d else 0.0  # area 2
        half[p] += o.weight * (o.side * in_p + (1 - o.side) * (1 - t))
        half[d] += o.weight * (o.side * in_d + (1 - o.side) * t)
        bone[p] += o.weight * o.side * (1 - in_p - in_d)
        for j, area in ((p, in_p), (d, in_d)):
            rounding[j] += o.weight * o.side * area**2 * (3 - 2 * area)
        if o.muscle:
            profile = _profile(t, parameters.peak[p], *parameters.exponents[p])
            muscles[ends.index((p, d))] += o.weight * (1 - o.side) * profile
    for b in place.between:
        low = min(int(b.place * 4), 3)
        palm[b.pair, low] += b.amount * (1 - (b.place * 4 - low))
        palm[b.pair, low + 1] += b.amount * (b.place * 4 - low)
    return Row(place.rest, c, half, bone, rounding, palm, muscles, swells)


def evaluate(
    row: Row,
    frame: Frame,
    parameters: Parameters,
    swelling: np.ndarray,
    thickening: np.ndarray,
    skeleton: Skeleton,
    ends: list[tuple[int, int]],
    pairs: list[tuple[int, int]],
) -> np.ndarray:
    """S' = Σ c J' + rot(normalise(Σ w q), g d + Σ m h)."""
    grow = 1.0 + (row.roundings * parameters.inflation + row.swellings * swelling) @ frame.ratio
    for n, (a, b) in enumerate(pairs):
        exponent = (parameters.palm[a] + parameters.palm[b]) / 2
        grow += thickening[n] * row.palm[n] @ (np.exp(-exponent * frame.closing[n]) - 1)
    bulge = np.zeros(3)
    for (p, d), amount in zip(ends, row.muscles, strict=True):
        if amount != 0.0:
            driven = (frame.ratio[p] + frame.ratio[d]) / 2
            bulge += amount * parameters.muscle[p] * driven * _height(skeleton, p, d, row.rest)
    blend = row.halfway @ frame.halfway + row.bones @ frame.rotations
    offset = row.rest - row.positions @ skeleton.rest
    return row.positions @ frame.positions + Rotation.from_quat(blend).as_matrix() @ (grow * offset + bulge)


def _height(skeleton: Skeleton, p: int, d: int, vertex: np.ndarray) -> np.ndarray:
    """y part of the offset from a segment, with the normals of both its joints blended along it."""
    along, offset = skeleton.rest[d] - skeleton.rest[p], vertex - skeleton.rest[p]
    t = min(max(offset @ along / (along @ along), 0.0), 1.0)
    normals = _normal(skeleton, p, d, p, d), _normal(skeleton, p, d, d, p)
    return sum(share * (offset @ n) * n for share, n in zip((1 - t, t), normals, strict=True))


def _heat(vertices: np.ndarray, faces: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Two steps of heat, dense."""
    count, tau = len(vertices), (BETA * radius) ** 2 / 2
    conducted, area = np.zeros((count, count)), np.zeros(count)
    corners = _saddles(vertices, faces, radius)
    exponent = np.zeros(len(faces))  # around a saddle corner of angle θ heat is conducted as r^((2π/θ)² − 1), and more
    for corner, turns, reach in corners:
        distance = np.linalg.norm(vertices[faces].mean(axis=1) - corner, axis=1)
        near = distance <= reach
        exponent[near] += 1.3 * (turns**-2 - 1) * np.log(distance[near] / reach)
    better = np.minimum(np.exp(exponent), 1e4)
    for k in range(3):
        apex, i, j = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        u, v = vertices[i] - vertices[apex], vertices[j] - vertices[apex]
        double = np.linalg.norm(np.cross(u, v), axis=1)
        np.add.at(area, apex, double / 6)
        weight = better * np.clip((u * v).sum(axis=1) / double, 1e-3, 1e3) / 2 * (tau[i] + tau[j]) / 2
        np.add.at(conducted, (i, j), weight)
        np.add.at(conducted, (j, i), weight)
    step = np.linalg.solve(np.diag(area + conducted.sum(axis=1)) - conducted, np.diag(area))
    return np.asarray(step @ step)


def _saddles(vertices: np.ndarray, faces: np.ndarray, radius: np.ndarray) -> list[tuple[np.ndarray, float, float]]:
    """Vertices whose angles sum to more than 1.03 of a full turn, to how many turns, and how far each reaches."""
    angle = np.zeros(len(vertices))
    for k in range(3):
        u, v = (vertices[faces[:, (k + n) % 3]] - vertices[faces[:, k]] for n in (1, 2))
        lengths = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
        np.add.at(angle, faces[:, k], np.arccos((u * v).sum(axis=1) / lengths))
    turns = angle / (2 * np.pi)
    return [(vertices[v], float(turns[v]), 0.4 * radius[v]) for v in np.flatnonzero(turns > 1.03)]


def _shrunk(row: np.ndarray) -> np.ndarray:
    return np.where(np.abs(row) > THRESHOLD, row - np.sign(row) * THRESHOLD, 0.0)


def palm_pairs(covering: Covering) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Neighbouring segments, fan by fan."""
    out = []
    for fan in covering.fans:
        ends = [(s.proximal, s.distal) for s in fan.segments]
        out += list(pairwise(ends))
    return out


def frames(covering: Covering, poses: Poses) -> list[Frame]:
    """What each pose gives the operators."""
    return [pose_frame(covering.skeleton, poses, f, palm_pairs(covering)) for f in range(len(poses))]


def pose_frame(
    skeleton: Skeleton, poses: Poses, f: int, pairs: Sequence[tuple[tuple[int, int], tuple[int, int]]] = ()
) -> Frame:
    """What pose f gives them."""
    q = poses.rotations[f]
    halfway = q.copy()
    for j, parent in enumerate(skeleton.parents):
        if parent >= 0:
            start = Rotation.from_quat(q[parent])
            turn = (start.inv() * Rotation.from_quat(q[j])).as_rotvec()
            half = (start * Rotation.from_rotvec(turn / 2.0)).as_quat()
            halfway[j] = half if half @ q[parent] > 0.0 else -half
    ratio = np.zeros(len(skeleton))
    for j in range(len(skeleton)):
        largest = skeleton.limits[j, CHANNELS.index("flexion"), 1]
        if skeleton.parents[j] >= 0 and largest > 1e-6:
            ratio[j] = min(max(poses.flexion[f, j] / largest, 0.0), 1.0)
    closing = np.zeros((max(len(pairs), 1), len(STATIONS)))
    for n, ((pa, da), (pb, db)) in enumerate(pairs):
        for i, t in enumerate(STATIONS):
            lengths = [
                np.linalg.norm((1 - t) * (x[pb] - x[pa]) + t * (x[db] - x[da]))
                for x in (skeleton.rest, poses.positions[f])
            ]
            if lengths[0] > 1e-9:
                closing[n, i] = min(np.log(lengths[1] / lengths[0]), 0.0)
    return Frame(poses.positions[f], halfway, q, ratio, closing)


def _profile(t: float, peak: float, before: float, beyond: float) -> float:
    a, b = (t / peak, before) if t <= peak else ((1 - t) / (1 - peak), beyond)
    rounded = a * (2 - a)
    low, high = POWER_OFFSET**b, (1 + POWER_OFFSET) ** b
    return ((rounded + POWER_OFFSET) ** b - low) / (high - low)


def _place(
    skeleton: Skeleton,
    fans: list[list[tuple[int, int]]],
    muscled: list[bool],
    vertex: np.ndarray,
    domain: np.ndarray,
    parameters: Parameters,
) -> Place:
    candidates: list[tuple[float, int, int, bool]] = []
    between: list[Between] = []
    pair = 0
    for fan, segments in enumerate(fans):
        share = _shares(skeleton, segments, vertex, parameters)
        for (p, d), part in zip(segments, share, strict=True):
            candidates.append((domain[fan] * part, p, d, muscled[fan]))
        for k in range(len(segments) - 1):
            (pa, da), (pb, db) = segments[k], segments[k + 1]
            ta, tb = _ratio(skeleton, pa, da, vertex), _ratio(skeleton, pb, db, vertex)
            amount = domain[fan] * 4 * share[k] * share[k + 1]
            between.append(Between(pair, pa, pb, amount, min(max((ta + tb) / 2, 0.0), 1.0)))
            pair += 1
    # the strongest four, faded by what the fifth has, so that an exchange is not seen
    candidates.sort(key=lambda c: -round(c[0], 9))
    threshold = max(candidates[4][0] if len(candidates) > 4 else 0.0, FLOOR)
    threshold = min(threshold, 0.999 * candidates[0][0])
    total = sum(max(c[0] - threshold, 0.0) for c in candidates[:4])
    operators = [
        _operator(skeleton, p, d, muscle, (weight - threshold) / total, vertex)
        for weight, p, d, muscle in candidates[:4]
        if weight > threshold
    ]
    between.sort(key=lambda b: -b.amount)
    third = between[2].amount if len(between) > 2 else 0.0
    for b in between[:2]:
        b.amount -= third
    return Place(vertex, operators, between[:2])


def _operator(skeleton: Skeleton, p: int, d: int, muscle: bool, weight: float, vertex: np.ndarray) -> Operator:
    ratio = _ratio(skeleton, p, d, vertex)
    offset = vertex - ((1 - ratio) * skeleton.rest[p] + ratio * skeleton.rest[d])
    t = min(max(ratio, 0.0), 1.0)
    side = 0.0
    for share, joint, other in ((1 - t, p, d), (t, d, p)):
        cosine = offset @ _normal(skeleton, p, d, joint, other) / np.linalg.norm(offset)
        x = min(max((cosine + SIDE_BAND) / (2 * SIDE_BAND), 0.0), 1.0)
        side += share * (3 * x**2 - 2 * x**3)
    return Operator(p, d, muscle, weight, ratio, side)


@cache
def _normal(skeleton: Skeleton, p: int, d: int, joint: int, other: int) -> np.ndarray:
    """Segment × flexion axis; where an axis lies along the segment, the other joint's (R20)."""
    along = skeleton.rest[d] - skeleton.rest[p]
    for j in (joint, other):
        normal = np.cross(along / np.linalg.norm(along), skeleton.axes[j])
        if np.linalg.norm(normal) > 1e-3:
            return normal / np.linalg.norm(normal)
    raise AssertionError("an oracle's skeleton has axes across its segments")


def _ratio(skeleton: Skeleton, p: int, d: int, vertex: np.ndarray) -> float:
    along = skeleton.rest[d] - skeleton.rest[p]
    t = (vertex - skeleton.rest[p]) @ along / (along @ along)
    if t < 0.0 and skeleton.parents[p] >= 0:
        return 0.0
    if t > 1.0 and d in skeleton.parents:
        return 1.0
    return t


@cache
def _longest(skeleton: Skeleton, segments: tuple[tuple[int, int], ...]) -> float:
    return max(float(np.linalg.norm(skeleton.rest[d] - skeleton.rest[p])) for p, d in segments)


def _shares(
    skeleton: Skeleton, segments: list[tuple[int, int]], vertex: np.ndarray, parameters: Parameters
) -> list[float]:
    """R of every virtual segment, remapped by the proximities; their sum lies between the two that hold the vertex."""
    ratios = [_ratio(skeleton, p, d, vertex) for p, d in segments]
    longest = _longest(skeleton, tuple(segments))
    passed = 0.0
    for k in range(len(segments) - 1):
        at = ratios[k : k + 2]
        if np.linalg.norm(skeleton.rest[segments[k][0]] - skeleton.rest[segments[k + 1][0]]) < 1e-3 * longest:
            at = [max(min(max(t, 0.0), 1.0) for t in ratios)] * 2
        feet, widths = [], []
        for (p, d), t in zip(segments[k : k + 2], at, strict=True):
            feet.append((1 - t) * skeleton.rest[p] + t * skeleton.rest[d])
            inner = min(max(t, 0.0), 1.0)
            widths.append(LATERAL * ((1 - inner) * parameters.proximity[p, 0] + inner * parameters.proximity[d, 1]))
        virtual = feet[1] - feet[0]
        r = (vertex - feet[0]) @ virtual / (virtual @ virtual) if np.linalg.norm(virtual) > 1e-9 else 0.0
        passed += min(max((r - widths[0]) / max(1 - sum(widths), 0.1), 0.0), 1.0)
    return [max(1 - abs(passed - k), 0.0) for k in range(len(segments))]
