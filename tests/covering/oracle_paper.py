"""The paper's own operators in float64, one vertex at a time: normals as cross products of final segments and axes.

Written from A §4–§6 and the readings C1–C24; shares nothing with what it checks but the order of the domains' columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering, Parameters
from warpjld.skeleton import CHANNELS, Poses, Skeleton

SLACK = 1e-9  # of the size, or of a ratio: a vertex that near a border lies on it, and what differs so little is equal


@dataclass
class Pose:
    """A skeleton's joints, the axes their bones carry, and its flexion ratios."""

    skeleton: Skeleton
    positions: np.ndarray
    turns: np.ndarray  # (J, 3, 3)
    ratio: np.ndarray

    @staticmethod
    def at_rest(skeleton: Skeleton) -> Pose:
        count = len(skeleton)
        return Pose(skeleton, skeleton.rest, np.tile(np.eye(3), (count, 1, 1)), np.zeros(count))

    @staticmethod
    def of(skeleton: Skeleton, poses: Poses, frame: int) -> Pose:
        turns = Rotation.from_quat(poses.rotations[frame]).as_matrix()
        largest = np.where(skeleton.parents >= 0, skeleton.limits[:, CHANNELS.index("flexion"), 1], 0.0)
        ratio = [
            min(max(flexion / limit, 0.0), 1.0) if limit > 1e-6 else 0.0
            for flexion, limit in zip(poses.flexion[frame], largest, strict=True)
        ]
        return Pose(skeleton, poses.positions[frame], turns, np.array(ratio))

    def original(self, p: int, d: int, joint: int) -> np.ndarray:
        """Final segment × the joint's axis as the segment carries it (Fig. 3b: the joint itself straight)."""
        return _unit(np.cross(_unit(self.positions[d] - self.positions[p]), self.turns[p] @ self.skeleton.axes[joint]))

    def modified(self, joint: int) -> np.ndarray:
        """Average of the normals that the two bones meeting at the joint carry there (Fig. 3c, C22, C23)."""
        parent = self.skeleton.parents[joint]
        axis = self.skeleton.axes[joint]
        begins = self.turns[joint] @ _unit(np.cross(self.skeleton.directions[joint], axis))
        if parent < 0:
            return begins
        towards = _unit(self.skeleton.rest[joint] - self.skeleton.rest[parent])
        ends = self.turns[parent] @ _unit(np.cross(towards, axis))
        return _unit(begins + ends)


@dataclass
class Area:
    """Where a vertex lies: on one segment, or in between two."""

    vertex: np.ndarray
    segments: list[tuple[int, int]]
    ratios: list[float]
    across: float
    external: bool
    muscle: bool


def places(covering: Covering, vertices: list[int]) -> list[Area]:
    """The area of every vertex."""
    out = []
    slack = SLACK * covering.surface.size
    for v in vertices:
        weights = covering.domains[v].tolist()
        fan = covering.fans[next(f for f, w in enumerate(weights) if w >= max(weights) - 1e-6)]
        segments = [(s.proximal, s.distal) for s in fan.segments]
        vertex = covering.surface.vertices[v]
        if len(segments) == 1:
            out.append(_alone(covering.skeleton, segments[0], vertex, fan.muscle, slack))
        else:
            out.append(_palm(covering.skeleton, segments, vertex, covering.parameters, slack))
    return out


def evaluate(area: Area, pose: Pose, parameters: Parameters) -> np.ndarray:
    """Coordinates in the initial basis, inflated, re-emitted in the final basis (§5.5, §6, R57)."""
    still = Pose.at_rest(pose.skeleton)
    origin0, basis0 = _basis(area, still, parameters)
    origin, basis = _basis(area, pose, parameters)
    local = np.linalg.solve(basis0, area.vertex - origin0)
    return origin + basis @ _inflated(area, local, still, pose, parameters)


def external_normal(pose: Pose, segment: tuple[int, int], ratio: float, parameters: Parameters) -> np.ndarray:
    """Fig. 8 in the joint areas, Fig. 9 in the buffer (C5, C6)."""
    p, d = segment
    t = min(max(ratio, 0.0), 1.0)
    prox_p, prox_d = parameters.proximity[p, 0], parameters.proximity[d, 1]
    if t < prox_p:
        part = t / prox_p
        return _unit(part * pose.original(p, d, p) + (1 - part) * pose.modified(p))
    if 1 - t < prox_d:
        part = (1 - t) / prox_d
        return _unit(part * pose.original(p, d, d) + (1 - part) * pose.modified(d))
    part = (t - prox_p) / (1 - prox_d - prox_p)
    return _unit(part * pose.original(p, d, d) + (1 - part) * pose.original(p, d, p))


def internal_normal(pose: Pose, segment: tuple[int, int], ratio: float) -> np.ndarray:
    """Fig. 10: Ratio N_dm + (1 − Ratio) N_pm."""
    t = min(max(ratio, 0.0), 1.0)
    return _unit(t * pose.modified(segment[1]) + (1 - t) * pose.modified(segment[0]))


def _basis(area: Area, pose: Pose, parameters: Parameters) -> tuple[np.ndarray, np.ndarray]:
    feet = [_foot(pose.positions, s, t) for s, t in zip(area.segments, area.ratios, strict=True)]
    p, d = area.segments[0]
    if len(feet) == 2:
        x = feet[1] - feet[0]
        normals = [external_normal(pose, s, t, parameters) for s, t in zip(area.segments, area.ratios, strict=True)]
        y = area.across * normals[1] + (1 - area.across) * normals[0]
        origin = feet[0] + area.across * x
    else:
        x = pose.positions[d] - pose.positions[p]
        ratio = area.ratios[0]
        y = external_normal(pose, (p, d), ratio, parameters) if area.external else internal_normal(pose, (p, d), ratio)
        origin = feet[0]
    x, y = _unit(x), _unit(y)
    return origin, np.column_stack([x, y, _unit(np.cross(x, y))])


def _inflated(area: Area, local: np.ndarray, still: Pose, pose: Pose, parameters: Parameters) -> np.ndarray:
    x, y, z = local
    p, d = area.segments[0]
    if len(area.segments) == 2:
        lengths = []
        for at in (still, pose):
            a, b = (_foot(at.positions, s, t) for s, t in zip(area.segments, area.ratios, strict=True))
            lengths.append(np.linalg.norm(b - a))
        scale = min(lengths[1] / lengths[0], 1.0)  # C3: where the neighbour comes closer
        exponent = (parameters.palm[p] + parameters.palm[area.segments[1][0]]) / 2
        return local * scale**-exponent
    t = min(max(area.ratios[0], 0.0), 1.0)
    if area.external:
        prox_p, prox_d = parameters.proximity[p, 0], parameters.proximity[d, 1]
        grown = 1.0
        if t < prox_p:
            grown += parameters.inflation[p] * pose.ratio[p] * (1 - t / prox_p)
        elif 1 - t < prox_d:
            grown += parameters.inflation[d] * pose.ratio[d] * (1 - (1 - t) / prox_d)
        return np.array([x, grown * y, grown * z])
    if not area.muscle:
        return local
    peak, (before, beyond) = parameters.peak[p], parameters.exponents[p]
    profile = (t / peak) ** before if t <= peak else ((1 - t) / (1 - peak)) ** beyond
    return np.array([x, y * (1 + parameters.muscle[p] * profile * (pose.ratio[p] + pose.ratio[d]) / 2), z])


def _alone(skeleton: Skeleton, segment: tuple[int, int], vertex: np.ndarray, muscle: bool, slack: float) -> Area:
    ratio = _ratio(skeleton, segment, vertex)
    side = (vertex - _foot(skeleton.rest, segment, ratio)) @ _straight_normal(skeleton, segment, ratio)
    return Area(vertex, [segment], [ratio], 0.0, bool(side > -slack), muscle)


def _palm(
    skeleton: Skeleton, segments: list[tuple[int, int]], vertex: np.ndarray, parameters: Parameters, slack: float
) -> Area:
    """The nine external and three internal areas of the nearest segment and the neighbour on the vertex's side."""
    ratios = [_ratio(skeleton, s, vertex) for s in segments]
    feet = [_foot(skeleton.rest, s, t) for s, t in zip(segments, ratios, strict=True)]
    apart = [float(np.linalg.norm(vertex - foot)) for foot in feet]
    k = next(i for i, distance in enumerate(apart) if distance <= min(apart) + slack)
    longest = max(np.linalg.norm(skeleton.rest[d] - skeleton.rest[p]) for p, d in segments)
    best, across = None, -np.inf
    for n in (k + 1, k - 1):
        if 0 <= n < len(segments) and np.linalg.norm(feet[n] - feet[k]) > 1e-3 * longest:
            virtual = feet[n] - feet[k]
            r = (vertex - feet[k]) @ virtual / (virtual @ virtual)
            if r > across + SLACK:
                best, across = n, r
    own = _alone(skeleton, segments[k], vertex, muscle=False, slack=slack)
    if best is None:
        return own
    low, high = 0.0, 1.0
    if own.external:
        low, high_width = (_width(segments[i], ratios[i], parameters) for i in (k, best))
        total = max(low + high_width, 1.0)
        low, high = low / total, 1.0 - high_width / total
    if across <= low + SLACK:
        return own
    if across >= high - SLACK:
        return _alone(skeleton, segments[best], vertex, muscle=False, slack=slack)
    return Area(vertex, [segments[k], segments[best]], [ratios[k], ratios[best]], across, True, False)


def _width(segment: tuple[int, int], ratio: float, parameters: Parameters) -> float:
    t = min(max(ratio, 0.0), 1.0)
    return (1 - t) * parameters.proximity[segment[0], 0] + t * parameters.proximity[segment[1], 1]


def _straight_normal(skeleton: Skeleton, segment: tuple[int, int], ratio: float) -> np.ndarray:
    still, t = Pose.at_rest(skeleton), min(max(ratio, 0.0), 1.0)
    p, d = segment
    return (1 - t) * still.original(p, d, p) + t * still.original(p, d, d)


def _ratio(skeleton: Skeleton, segment: tuple[int, int], vertex: np.ndarray) -> float:
    p, d = segment
    along = skeleton.rest[d] - skeleton.rest[p]
    t = float((vertex - skeleton.rest[p]) @ along / (along @ along))
    for end in (0.0, 1.0):
        if abs(t - end) < SLACK:
            return end
    if t < 0.0 and skeleton.parents[p] >= 0:
        return 0.0
    if t > 1.0 and d in skeleton.parents:
        return 1.0
    return t


def _foot(positions: np.ndarray, segment: tuple[int, int], ratio: float) -> np.ndarray:
    return positions[segment[0]] + ratio * (positions[segment[1]] - positions[segment[0]])


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
