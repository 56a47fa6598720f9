"""Penetration of an arm into the rest of its body: spheres along its bones against the skin of the posed body."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.intersections import crossing_faces
from warpjld.geometry.rotations import rotate
from warpjld.grasp.palm import palm_of
from warpjld.skeleton import Poses, Skeleton
from warpjld.skeleton.arm import Arm
from warpjld.skeleton.hand import DIGITS

__all__ = ["ArmClearance", "pierced_faces"]

_UPPER, _FORE, _HAND, _DIGIT = (0.6, 0.75, 0.9), (0.0, 0.2, 0.4, 0.6, 0.8), (0.0, 0.5, 1.0), (0.0, 0.5, 1.0)
"""Places of the spheres along the upper arm, the forearm, the line from wrist to palm, and the line from a digit's
second joint to its tip, as fractions of each.

The upper arm's first half merges with the trunk and has none.
"""
_SPACING = 0.015
"""Longest edge of the triangles whose centres sample the skin [m]."""
_BESIDE = 0.15
"""Half-width of the window around a sphere, as a fraction of the bone, whose skin determines the sphere's radius."""
_Line = tuple[NDArray[np.float64], NDArray[np.float64], tuple[float, ...]]
"""Ends of a line [m] and places on it, as fractions of its length."""
_FAR = 0.2
"""Distance from the skin beyond which a sphere is not inside [m]: nothing in a body is as deep. Searches for the
nearest point of the skin end there."""
_SHOULDER = 2.5
"""Distance from the shoulder, in radii of the upper arm, within which skin belongs to both arm and trunk: ignored."""


class ArmClearance:
    """Penetration depths of an arm in the skin of trunk, legs, head and the other arm, for one pose of the body.

    The arm is approximated by a chain of spheres with the arm's radius at rest; the skin by points with normals.

    Args:
        covering: The body.
        arm: One of its arms.
        body: The pose of everything else, one frame.
    """

    def __init__(self, covering: Covering, arm: Arm, body: Poses) -> None:
        import trimesh
        from scipy.spatial import cKDTree

        self._arm = arm
        side = arm.skeleton.names[arm.joints[-1]].partition(".")[0]
        self.own = _own_vertices(covering, arm)
        wrist, rest, posed = arm.joints[-1], arm.skeleton.rest, body.positions[0]
        palm, ends = palm_of(arm.skeleton, side).middle, _digits(arm.skeleton, side)
        lines = [(rest[wrist], palm, _HAND)] + [(rest[a], rest[b], _DIGIT) for a, b in ends]
        self._radii = self._thickness(covering, lines)
        # the hand's own angles do not change: its spheres are constant in the wrist's axes
        along = [np.outer(_HAND, palm - rest[wrist])]
        for a, b in ends:
            first, last = arm.carried(posed[a], body), arm.carried(posed[b], body)
            along.append(first + np.outer(_DIGIT, last - first))
        self._hand = np.concatenate(along)
        vertices = np.asarray(covering.deform(body)[0], dtype=np.float64)
        faces = covering.surface.faces
        faces = faces[~self.own[faces].any(axis=1)]
        fine, small = trimesh.remesh.subdivide_to_size(vertices, faces, _SPACING, max_iter=20)
        corners = fine[small]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normals, axis=1)
        middles = corners.mean(axis=1)
        shoulder = arm.chains(np.zeros((len(arm.skeleton), 4)), np.zeros((1, len(arm.free))), body)[0][0, arm.shoulder]
        near = np.linalg.norm(middles - shoulder, axis=1) < _SHOULDER * self._radii[0]
        kept = np.asarray((size > 0.0) & ~near)
        self._middles, self._normals = middles[kept], normals[kept] / size[kept, None]
        self._tree = cKDTree(self._middles)

    def __call__(self, positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Penetration depths of the spheres [m], 0 where a sphere is outside, shape (B, spheres).

        Args:
            positions: Joints of B poses of the arm [m], shape (B, chain, 3).
            rotations: Their rotations from rest, quaternions x, y, z, w, shape (B, chain, 4).
        """
        points = self._samples(positions, rotations)
        away, near = self._tree.query(points, distance_upper_bound=_FAR)
        found = np.isfinite(away)
        nearest = near[found]
        height = ((points[found] - self._middles[nearest]) * self._normals[nearest]).sum(axis=-1)
        away[found] *= np.where(height < 0.0, -1.0, 1.0)
        return np.asarray(np.maximum(self._radii - away, 0.0))

    def wider(self, by: float) -> ArmClearance:
        """The same with spheres larger by a margin [m]."""
        out = copy(self)
        out._radii = self._radii + by
        return out

    def _samples(self, positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> NDArray[np.float64]:
        arm = self._arm
        shoulder, elbow, wrist = (positions[:, k] for k in (arm.shoulder, arm.elbow, arm.wrist))
        lines = ((shoulder, elbow, _UPPER), (elbow, wrist, _FORE))
        bones = np.stack([a + share * (b - a) for a, b, shares in lines for share in shares], axis=1)
        hand = wrist[:, None] + rotate(rotations[:, arm.wrist, None], self._hand[None])
        return np.concatenate([bones, hand], axis=1)

    def _thickness(self, covering: Covering, hand: Sequence[_Line]) -> NDArray[np.float64]:
        """Radius of the arm at every sphere at rest [m]."""
        arm, rest = self._arm, self._arm.skeleton.rest
        shoulder, elbow, wrist = (rest[arm.joints[k]] for k in (arm.shoulder, arm.elbow, arm.wrist))
        skin = covering.surface.vertices[self.own]
        out = []
        for a, b, shares in ((shoulder, elbow, _UPPER), (elbow, wrist, _FORE), *hand):
            along = b - a
            share = (skin - a) @ along / (along @ along)
            away = np.linalg.norm(skin - a - share[:, None] * along, axis=1)
            for at in shares:
                beside = away[np.abs(share - at) < _BESIDE]
                beside = beside[beside < np.linalg.norm(along)]
                # a low percentile: where the cross-section is not round, the arm rests on its thin side
                out.append(float(np.percentile(beside, 25)) if len(beside) else 0.0)
        return np.array(out)


def pierced_faces(covering: Covering, arm: Arm, skin: NDArray[np.floating]) -> NDArray[np.int64]:
    """Faces of the body that are crossed by an arm's forearm or hand.

    Args:
        covering: The body.
        arm: One of its arms.
        skin: The body's surface in a pose [m], shape (V, 3).
    """
    faces = covering.surface.faces
    below = np.all(_own_vertices(covering, arm, whole=False)[faces], axis=1)
    rest = ~np.any(_own_vertices(covering, arm)[faces], axis=1)
    pairs = crossing_faces(skin, faces).pairs
    other = pairs[below[pairs[:, 0]] & rest[pairs[:, 1]]][:, 1], pairs[below[pairs[:, 1]] & rest[pairs[:, 0]]][:, 0]
    return np.unique(np.concatenate(other))


def _digits(skeleton: Skeleton, side: str) -> list[tuple[int, int]]:
    """Second joint and tip of each digit of a hand, as numbers of joints."""
    names = {name: k for k, name in enumerate(skeleton.names)}
    pairs = [(f"{side}.{digit}.knuckle2", f"{side}.{digit}.tip") for digit in DIGITS]
    return [(names[a], names[b]) for a, b in pairs if a in names and b in names]


def _own_vertices(covering: Covering, arm: Arm, *, whole: bool = True) -> NDArray[np.bool_]:
    """Mask of the vertices on an arm and its hand, or only on those below the elbow, shape (V,)."""
    skeleton = arm.skeleton
    own = np.zeros(len(skeleton), dtype=bool)
    own[arm.joints[arm.shoulder if whole else arm.elbow]] = True
    for joint, parent in enumerate(skeleton.parents.tolist()):
        own[joint] |= parent >= 0 and own[parent]
    anchors = covering.anchors
    strongest = anchors.segment[np.arange(len(anchors)), anchors.weight.argmax(axis=1)]
    return np.asarray(own[anchors.ends[strongest, 0]])
