"""How good a closed hand's grasp is: what touches, how deep, whether it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.grasp.both_ways import BothWays
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.finer import FinerSkin
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.quality.closure import force_closure
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.touch import Patches, contact_patches
from warpjld.grasp.quality.wrench_space import wrench_space
from warpjld.grasp.segments import SEGMENTS, vertex_segments
from warpjld.skeleton import Poses

__all__ = ["Judge", "Verdict"]

_TOUCH = 5e-4  # skin this near touches [m]
_NEARLY = 2.5e-3  # the same at a first look [m]
_SPACING = 1.5e-3  # of the skin's points [m]
_EDGES = 8  # of friction cones
_DIGIT = 0.01  # what a digit more is worth, in epsilon [N]


@dataclass(frozen=True)
class Verdict:
    """Judgement of one closed hand.

    Attributes:
        closed: Force closure by the contacts that can press.
        epsilon: Ferrari–Canny epsilon of these [N], norm L1, torques over the object's largest radius.
        digits: Digits that press, thumb included, e.g. ``thumb``.
        palm: Whether the palm presses.
        depth: Depth of hand and object in one another [m], see ``BothWays``.
    """

    closed: bool
    epsilon: float
    digits: tuple[str, ...]
    palm: bool
    depth: float

    @property
    def score(self) -> float:
        """epsilon + 0.01 N a digit where the grasp is force closed, else 0."""
        return self.epsilon + _DIGIT * len(self.digits) if self.closed else 0.0


class Judge:
    """Judges hands that closed on an object.

    Only contacts count with which a hand can press: those on the inner side of digits and palm, where a segment's skin
    normal does not point to the back of the hand. A digit that merely leans on the object with its back holds nothing.

    Args:
        covering: The hand.
        thing: The object where it stands.
        side: Which hand of the covering.
        friction: Coulomb coefficient.
    """

    def __init__(self, covering: Covering, thing: GraspObject, side: str, friction: float) -> None:
        self.covering, self.friction, self.both = covering, friction, BothWays(covering, thing)
        self._objects = ObjectSet(thing)
        self._normals = Rotation.from_quat(thing.place.rotation[0]).apply(thing.normals)
        self._center = thing.place.apply(thing.centroid[None])[0, 0]
        self._radius = float(np.linalg.norm(thing.vertices - thing.centroid, axis=1).max())
        self._finer = FinerSkin(covering.surface.vertices, covering.surface.faces, _SPACING)
        self._segments = vertex_segments(covering, side)
        skeleton = covering.skeleton
        joints = [f"{side}.{name}" if name != "palm" else f"{side}.middle.base" for name in SEGMENTS]
        self._joints = np.array([skeleton.names.index(name) if name in skeleton.names else 0 for name in joints])
        # segment × flexion axis points to the back of the hand (R20)
        self._inner = -np.cross(skeleton.directions[self._joints], skeleton.axes[self._joints])
        palm = skeleton.names.index(f"{side}.wrist")
        self._joints[-1] = palm

    def first_look(self, poses: Poses, vertices: NDArray[np.floating]) -> NDArray[np.float64]:
        """Rank hands that closed roughly; larger is better, shape (G,), 0 and below for what will hardly do."""
        found = self._objects.distances(vertices, which=np.zeros(len(vertices), int), nearest=True)
        assert found.point is not None
        ranks = np.zeros(len(vertices))
        for g, skin in enumerate(vertices):
            patches = contact_patches(
                skin,
                self.covering.surface.faces,
                self._segments,
                SEGMENTS,
                found.distance[g],
                found.point[g],
                self._normals[found.face[g]],
                tolerance=_NEARLY,
            )
            contacts, digits, palm = self._pressing(patches, poses[g : g + 1])
            deep = max(0.0, -float(found.distance[g].min()) - 1e-3)
            if ("thumb" not in digits and not palm) or len(digits) < 2:
                ranks[g] = -1.0
                continue
            closure = force_closure(contacts, self._center, torque_scale=self._radius, edges=6)
            ranks[g] = closure.margin + 0.04 * len(digits) + 0.1 * closure.closed - 50.0 * deep
        return ranks

    def judge(self, poses: Poses, vertices: NDArray[np.floating]) -> Verdict:
        """Judge one hand: its pose, and its deformed skin (V, 3) [m]."""
        points = self._finer.points(vertices)
        found = self._objects.distances(points, nearest=True)
        assert found.point is not None
        patches = contact_patches(
            points,
            self._finer.faces,
            self._segments[self._finer.parents],
            SEGMENTS,
            found.distance[0],
            found.point[0],
            self._normals[found.face[0]],
            tolerance=_TOUCH,
        )
        contacts, digits, palm = self._pressing(patches, poses)
        depth = max(float(self.both.depths(vertices).max()), -float(found.distance[0].min()))
        closed = force_closure(contacts, self._center, torque_scale=self._radius, edges=_EDGES).closed
        epsilon = 0.0
        if closed:
            epsilon = wrench_space(contacts, self._center, torque_scale=self._radius, edges=_EDGES).epsilon
        return Verdict(closed and epsilon > 0.0, epsilon, digits, palm, depth)

    def _pressing(self, patches: Patches, poses: Poses) -> tuple[Contacts, tuple[str, ...], bool]:
        rows = [SEGMENTS.index(name) for name in patches.names]
        turns = Rotation.from_quat(poses.rotations[0, self._joints[rows]]) if rows else None
        inner = turns.apply(self._inner[rows]) if turns is not None else np.zeros((0, 3))
        kept = np.flatnonzero((inner * patches.skin_normals).sum(axis=1) > 0.0)
        spin = patches.contacts(self.friction).spin
        contacts = Contacts(patches.points[kept], patches.normals[kept], np.array(self.friction), spin[kept])
        names = [patches.digits[k] for k in kept]
        return contacts, tuple(dict.fromkeys(n for n in names if n != "palm")), "palm" in names
