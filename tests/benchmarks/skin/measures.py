"""What is measured of one deformed surface, beside its rest surface. NumPy, float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.poses import Posed
from tests.benchmarks.skin.rigs import BenchRig
from warpjld.covering.intersections import Parts, crossing_faces
from warpjld.covering.quality import edge_stretch, enclosed_volume, unique_edges
from warpjld.geometry.rotations import rotate, unit
from warpjld.skeleton import Skeleton
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses

__all__ = ["Measured", "Measuring", "dihedral_angles", "fold_kinds", "roughness"]


@dataclass(frozen=True)
class Measured:
    """Of one rig, pose and method.

    Attributes:
        volume: Of the flesh, relative change [%].
        limb: The same of the limb that moves, its cut ends closed by fans [%].
        least, low, high, largest: Edge stretch: smallest, .5 %, 99.5 %, largest.
        joint: Faces that cross others of the same part, or of the one that it joins on to along a limb; more than at
            rest, as all counts of faces.
        digits, palm, other: Faces that cross those of another digit; of the palm (a digit's); of anything else.
        roughness: RMS over edges of how far dihedral angles grow beyond rest [degrees].
        thickness: Least width of the flesh at the joints that bend, in their plane or across it, of that at rest.
    """

    volume: float
    limb: float
    least: float
    low: float
    high: float
    largest: float
    joint: int
    digits: int
    palm: int
    other: int
    roughness: float
    thickness: float


class Measuring:
    """Measures surfaces of one rig; what depends on the rest surface alone is computed once."""

    def __init__(self, bench: BenchRig) -> None:
        self.bench = bench
        surface = bench.covering.surface
        self.rest = np.asarray(surface.vertices, dtype=np.float64)
        self.faces = surface.faces
        self.flesh = bench.covering.flesh.faces
        self.edges = unique_edges(self.faces)
        self.dihedral = dihedral_angles(self.rest, self.faces)
        self.crossing = _keys(crossing_faces(self.rest, self.faces).pairs, len(self.faces))
        self.volume = enclosed_volume(self.rest, self.flesh)
        palms = [f for f, fan in enumerate(bench.covering.fans) if fan.name.endswith("palm")]
        self.palm = np.isin(bench.covering.domains.argmax(axis=1), palms)
        # the segment whose operator holds most of a vertex
        self.owner = np.array([fan.segments[0].proximal for fan in bench.covering.fans])[
            bench.covering.domains.argmax(axis=1)
        ]

    def measure(self, points: NDArray[np.floating], posed: Posed) -> Measured:
        """Of one surface, shape (V, 3)."""
        moved = np.asarray(points, dtype=np.float64)
        stretch = edge_stretch(self.rest, moved, self.edges)
        low, high = np.percentile(stretch, [0.5, 99.5])
        limb = self.flesh[np.isin(self.owner, posed.limb)[self.flesh].all(axis=1)]
        pairs = crossing_faces(moved, self.faces).pairs
        pairs = pairs[~np.isin(_keys(pairs, len(self.faces)), self.crossing)]
        return Measured(
            100.0 * float(enclosed_volume(moved, self.flesh) / self.volume - 1.0),
            100.0 * float(enclosed_volume(moved, limb) / enclosed_volume(self.rest, limb) - 1.0)
            if len(limb)
            else float("nan"),
            float(stretch.min()),
            float(low),
            float(high),
            float(stretch.max()),
            *fold_kinds(pairs, self.bench.parts, self.bench.rig.skeleton),
            roughness(self.dihedral, dihedral_angles(moved, self.faces)),
            self._thickness(moved, posed),
        )

    def _thickness(self, moved: NDArray[np.float64], posed: Posed) -> float:
        skeleton = self.bench.rig.skeleton
        at_rest = self._widths(self.rest, None, posed.bent)
        widths = self._widths(moved, posed.poses, posed.bent)
        ratio = widths / at_rest
        ratio = ratio[[skeleton.parents[j] >= 0 for j in posed.bent]]
        return float(np.nanmin(ratio)) if np.isfinite(ratio).any() else float("nan")

    def _widths(self, points: NDArray[np.float64], poses: Poses | None, joints: tuple[int, ...]) -> NDArray[np.float64]:
        """Widths at joints in the bisecting plane: along the flexion normal and the flexion axis, shape (N, 2)."""
        skeleton = self.bench.rig.skeleton
        out = np.full((len(joints), 2), np.nan)
        for row, j in enumerate(joints):
            parent = int(skeleton.parents[j])
            near = np.isin(self.owner, [j, parent])
            if skeleton.names[parent].endswith("wrist"):
                near |= self.palm  # its one operator holds all metacarpals
            corners = points[self.flesh[near[self.flesh].any(axis=1)]]
            centre = skeleton.rest[j] if poses is None else poses.positions[0, j]
            directions = np.stack([np.cross(skeleton.directions[j], skeleton.axes[j]), skeleton.axes[j]])
            if poses is not None:
                q = poses.rotations[0, [j, parent]]
                half = unit(q[0] + q[1] * (1.0 if q[0] @ q[1] >= 0.0 else -1.0))
                directions = rotate(half, directions)
            for k, direction in enumerate(unit(directions)):
                out[row, k] = _ray(corners, centre, direction) + _ray(corners, centre, -direction)
        return out


def dihedral_angles(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Unsigned angle [rad] between the normals of the two faces of each inner edge, 0 where flat, shape (E,)."""
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    key = np.sort(half, axis=1) @ [int(faces.max()) + 1, 1]
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    face = np.tile(np.arange(len(faces)), 3)[order]
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    one, other = normal[face[:-1][same]], normal[face[1:][same]]
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))


def roughness(rest: NDArray[np.float64], moved: NDArray[np.float64]) -> float:
    """RMS growth [degrees] of dihedral angles beyond rest; edges that flatten count as nought."""
    return float(np.degrees(np.sqrt(np.mean(np.maximum(moved - rest, 0.0) ** 2))))


def fold_kinds(pairs: NDArray[np.int32], parts: Parts, skeleton: Skeleton) -> tuple[int, int, int, int]:
    """Faces in crossing pairs (N, 2) within a part or at a joint, digit × digit, digit × palm, and any others."""
    digit = np.array([name.rpartition(".")[2] in DIGITS for name in parts.names])
    palm = np.array([name.rpartition(".")[2] == "palm" for name in parts.names])
    joined = np.array([[_joined(a, b, skeleton) for b in parts.names] for a in parts.names])
    a, b = parts.of_face[pairs].T
    at_joint = (a == b) | joined[a, b]
    both = ~at_joint & digit[a] & digit[b]
    on_palm = ~at_joint & ((digit[a] & palm[b]) | (palm[a] & digit[b]))
    kinds = (at_joint, both, on_palm, ~(at_joint | both | on_palm))
    one, two, three, four = (len(np.unique(pairs[kind])) for kind in kinds)
    return one, two, three, four


def _joined(a: str, b: str, skeleton: Skeleton) -> bool:
    """Whether two parts of a body are neighbours in the joint tree."""
    if a not in skeleton.names or b not in skeleton.names:
        return False
    i, j = skeleton.names.index(a), skeleton.names.index(b)
    return bool(skeleton.parents[i] == j or skeleton.parents[j] == i)


def _keys(pairs: NDArray[np.int32], faces: int) -> NDArray[np.int64]:
    return pairs[:, 0].astype(np.int64) * faces + pairs[:, 1]


def _ray(corners: NDArray[np.float64], start: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
    """Distance along a ray to the first of triangles (T, 3, 3); NaN where it meets none (Möller and Trumbore 1997)."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, edge2)
    det = (edge1 * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = start - corners[:, 0]
        u = (s * p).sum(axis=1) / det
        q = np.cross(s, edge1)
        v = q @ direction / det
        t = (edge2 * q).sum(axis=1) / det
    hit = t[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)]
    return float(hit.min()) if len(hit) else float("nan")
