"""Clearance of prescribed bones from rigid obstacles and from bones of other digits, known before a solve (R112).

Flesh between a bone and a rigid wall stiffens without bound. The remaining thickness of flesh at the nearest node of a
bone, relative to that at rest, indicates the pressure to be expected: about 0.3 MPa at 0.5, 1–2 MPa at 0.38, tens of
MPa at 0.125 (three grasps of two hands: a rule of thumb). At 0 or less there is no solution: the bone is inside the
object. The same holds for the flesh between the bones of two digits, whose thickness is the sum of both: a pair of
fingers pressed side by side without friction had 0.36 MPa at 0.5, and no equilibrium was found beyond. Between two
actors, the distance of a bone from the other's bone is that from its skin, plus the flesh under that skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.skin_obstacle import SkinObstacle
from warpjld.simulation.bodies.skin_parts import digit_of_label
from warpjld.skeleton import DIGITS

__all__ = ["TIGHT", "BoneClearance", "TightBone", "nearest_digits"]

TIGHT = 0.4
"""Relative thickness of the flesh over a bone below which pressures of about 1 MPa are to be expected."""
_SQUEEZED = 0.5
"""The same between the bones of two digits below which that is given as the reason if no equilibrium is found."""
_BONE = "the bone of "
"""Beginning of the name of a digit's bone where it is what is near."""
_OTHER_BONE = "the bones of "
"""The same of another actor's."""
_LEAST = 5e-4
"""Bone nodes with thinner flesh than this at rest are ignored, since they lie at a cut [m]."""


@dataclass(frozen=True)
class TightBone:
    """Smallest clearance between a bone of a digit or the palm and an object.

    Attributes:
        actor: Name of the actor.
        digit: ``index``, …, or ``palm``; empty for other bones of a body.
        object: Name of the object, ``the bone of …`` for another digit, or ``the bones of …`` for another actor.
        left: Distance relative to the thickness of the flesh at rest: 1 or more without compression, below 0 inside the
            object.
        distance: Signed distance [m], negative inside.
    """

    actor: str
    digit: str
    object: str
    left: float
    distance: float

    @property
    def text(self) -> str:
        """``the bone of LEFT index is 1.2 mm inside CAN, which cannot give way``."""
        whose = f"the bone of {self.actor} {self.digit}" if self.digit else f"a bone of {self.actor}"
        if self.left > 0.0:
            flesh = "the flesh between them" if self.object.startswith((_BONE, _OTHER_BONE)) else "its flesh"
            return f"{whose} is {1e3 * self.distance:.2g} mm from {self.object}, {100 * self.left:.0f} % of {flesh}"
        return f"{whose} is {-1e3 * self.distance:.2g} mm inside {self.object}, which cannot give way"


class BoneClearance:
    """Clearance of the bones of a model's hands, relative to the flesh over them at rest.

    Args:
        model: The contact model; its motion does not matter.
    """

    def __init__(self, model: ContactModel) -> None:
        self._model = model

    @cached_property
    def _bones(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], list[str]]]:
        """By hand: bone nodes, index of their digit, thickness of the flesh over them [m], names of the digits."""
        return {hand.name: _bones_of(hand) for hand in self._model.hands}

    def inside(self, model: ContactModel, time: float) -> str | None:
        """Message about a bone inside an object at a time, with the frame; None if there is none."""
        worst = min(self.nearest(model, time), key=lambda bone: bone.left, default=None)
        return None if worst is None or worst.left > 0.0 else f"at frame {model.start + time:.4g}: {worst.text}"

    def crushing(self, model: ContactModel, time: float) -> str:
        """Message about bones of two digits or actors that crush the flesh between them at a time; empty if none do.

        That is no reason to refuse a pose, as flesh may bulge aside, but the reason where no equilibrium is found.
        """
        found = (*self.between_digits(model, time), *self.between_actors(model, time))
        worst = min(found, key=lambda bone: bone.left, default=None)
        return "" if worst is None or worst.left >= _SQUEEZED else worst.text

    def between_digits(self, model: ContactModel, time: float) -> list[TightBone]:
        """Least relative thickness of the flesh between the bones of two digits at a time, where it is below 1."""
        out = []
        for hand in model.hands:
            nodes, digit, depth, names = self._bones[hand.name]
            for one, other, left, distance in nearest_digits(_placed(hand, nodes, time), digit, depth):
                if {names[one], names[other]} <= set(DIGITS):
                    out.append(TightBone(hand.name, names[one], _BONE + names[other], left, distance))
        return out

    def between_actors(self, model: ContactModel, time: float) -> list[TightBone]:
        """Least relative thickness of flesh between a digit's bones and another actor's at a time, where below 1."""
        out = []
        for hand, other in permutations(model.hands, 2):
            nodes, digit, depth, names = self._bones[hand.name]
            if not len(nodes) or not len(self._bones[other.name][0]):
                continue
            x = _placed(hand, nodes, time)
            to_skin, beneath = self._flesh_of(other, x, time)
            left = (to_skin + beneath) / (depth + beneath)
            for number in np.unique(digit[left < 1.0]):
                mine = np.flatnonzero(digit == number)
                least = mine[int(np.argmin(left[mine]))]
                away = float(to_skin[least] + beneath[least])
                out.append(TightBone(hand.name, names[number], _OTHER_BONE + other.name, float(left[least]), away))
        return out

    def _flesh_of(
        self, hand: FleshBody, points: NDArray[np.float64], time: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Signed distances of points (n, 3) from a hand's skin at a time [m], infinite where the nearest skin has no
        flesh, and the thickness of its flesh over the nearest bone [m]; both of shape (n,)."""
        from scipy.spatial import cKDTree

        nodes, _, depth, _ = self._bones[hand.name]
        skin = SkinObstacle(hand.bones.animation, hand.bones.start)
        found = skin.project(points, time)
        vertices, _ = skin.mesh(time)
        soft = hand.fleshed[cKDTree(vertices).query(found.closest)[1]]
        near = cKDTree(_placed(hand, nodes, time)).query(points)[1]
        return np.where(soft, found.distance, np.inf), depth[near]

    def nearest(self, model: ContactModel, time: float) -> list[TightBone]:
        """Bone with the least relative thickness of flesh at a time, by digit and obstacle, where it is below 1."""
        out = []
        for hand in model.hands:
            nodes, digit, depth, names = self._bones[hand.name]
            x = _placed(hand, nodes, time)
            for name, obstacle in model.obstacles.items():
                distance = obstacle.project(x, time).distance
                left = distance / depth
                for number in np.unique(digit[left < 1.0]):
                    mine = np.flatnonzero(digit == number)
                    least = mine[int(np.argmin(left[mine]))]
                    out.append(TightBone(hand.name, names[number], name, float(left[least]), float(distance[least])))
        return out


def nearest_digits(
    x: NDArray[np.float64], digit: NDArray[np.int64], depth: NDArray[np.float64]
) -> list[tuple[int, int, float, float]]:
    """Pairs of digits whose bones are nearer to each other than the flesh over both is thick.

    Args:
        x: Positions of bone nodes [m], shape (n, 3).
        digit: Digit of each, shape (n,).
        depth: Thickness of the flesh over each at rest [m], shape (n,).

    Returns:
        Both digits, distance over thickness, and distance [m], where the second is least.
    """
    from scipy.spatial import cKDTree

    out = []
    members = [np.flatnonzero(digit == number) for number in np.unique(digit)]
    trees = [cKDTree(x[mine]) for mine in members]
    for k, mine in enumerate(members):
        for other, tree in zip(members[k + 1 :], trees[k + 1 :], strict=True):
            distance, near = tree.query(x[mine])
            left = distance / (depth[mine] + depth[other[near]])
            least = int(np.argmin(left))
            if left[least] < 1.0:
                pair = int(digit[mine[least]]), int(digit[other[near[least]]])
                out.append((*pair, float(left[least]), float(distance[least])))
    return out


def _placed(hand: FleshBody, nodes: NDArray[np.int64], time: float) -> NDArray[np.float64]:
    """Positions of bone nodes at a time [m], shape (n, 3)."""
    known = hand.prescribed(time)
    place = np.full(3 * len(hand.mesh.nodes), np.nan)
    place[known.degrees] = known.values
    return np.asarray(hand.mesh.nodes[nodes] + place.reshape(-1, 3)[nodes])


def _bones_of(
    hand: FleshBody,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], list[str]]:
    quads = hand.mesh.quads(hand.hand.skin_faces)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    parts = [_part(name) for name in hand.hand.segments]
    names = list(dict.fromkeys(parts))
    nodes = np.concatenate(hand.hand.bone_nodes).astype(np.int64)
    count = [len(one) for one in hand.hand.bone_nodes]
    digit = np.repeat([names.index(part) for part in parts], count)
    depth = -Facets(hand.mesh.nodes, triangles).project(hand.mesh.nodes[nodes]).distance
    covered = np.flatnonzero(depth > _LEAST)
    return nodes[covered], digit[covered].astype(np.int64), depth[covered], names


def _part(segment: str) -> str:
    """Digit of a bone's segment, ``palm``, or nothing: ``left.elbow`` is of neither."""
    part = digit_of_label(segment)
    return part if part in DIGITS or set(segment.split(".")) & {"palm", "carpus", "wrist"} else ""
