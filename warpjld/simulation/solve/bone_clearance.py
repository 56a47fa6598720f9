"""How near prescribed bones come to what cannot give way, seen before anything is solved (R112).

Flesh between a bone and a rigid wall stiffens without bound: what is left of it at the nearest node of a bone, over
what that node has at rest, tells what pressure is to be expected, about .3 MPa at a half, 1–2 MPa at .38, tens at an
eighth (three grasps of two hands: a rule of thumb). At nothing no force can help: the bone is in the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.skin_parts import digit_of_label

__all__ = ["TIGHT", "BoneClearance", "TightBone"]

TIGHT = 0.4
"""Share of a bone's flesh that is left, below which pressures of a megapascal are to be expected."""
_LEAST = 5e-4
"""Bones whose flesh is thinner than this at rest say nothing: they lie at a cut [m]."""


@dataclass(frozen=True)
class TightBone:
    """The bone of a digit, or of the palm, that comes nearest to an object.

    Attributes:
        actor: Whose.
        digit: ``index``, …, or ``palm``.
        object: What it comes near to.
        left: Distance over the flesh at rest: 1 and more where the flesh is not pressed, below 0 inside the object.
        distance: [m], negative inside.
    """

    actor: str
    digit: str
    object: str
    left: float
    distance: float

    @property
    def text(self) -> str:
        """``the bone of LEFT index is 1.2 mm inside CAN, which cannot give way``."""
        whose = f"the bone of {self.actor} {self.digit}"
        if self.left > 0.0:
            return f"{whose} is {1e3 * self.distance:.2g} mm from {self.object}, {100 * self.left:.0f} % of its flesh"
        return f"{whose} is {-1e3 * self.distance:.2g} mm inside {self.object}, which cannot give way"


class BoneClearance:
    """Bones of a model's hands, and the flesh over them at rest.

    Args:
        model: Everything, however it is driven.
    """

    def __init__(self, model: ContactModel) -> None:
        self._model = model

    @cached_property
    def _bones(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], list[str]]]:
        """By hand: nodes, number of their digit, flesh over them [m], names of the digits."""
        return {hand.name: _bones_of(hand) for hand in self._model.hands}

    def inside(self, model: ContactModel, time: float) -> str | None:
        """A bone that lies in an object at a time, in words with the frame: no force can part them."""
        worst = min(self.nearest(model, time), key=lambda one: one.left, default=None)
        return None if worst is None or worst.left > 0.0 else f"at frame {model.start + time:.4g}: {worst.text}"

    def nearest(self, model: ContactModel, time: float) -> list[TightBone]:
        """Of every digit and obstacle the bone that has least flesh left at a time; those with all of it are left
        out."""
        out = []
        for hand in model.hands:
            nodes, digit, depth, names = self._bones[hand.name]
            known = hand.prescribed(time)
            place = np.full(3 * len(hand.mesh.nodes), np.nan)
            place[known.degrees] = known.values
            x = hand.mesh.nodes[nodes] + place.reshape(-1, 3)[nodes]
            for name, obstacle in model.obstacles.items():
                distance = obstacle.project(x, time).distance
                left = distance / depth
                for number in np.unique(digit[left < 1.0]):
                    mine = np.flatnonzero(digit == number)
                    least = mine[int(np.argmin(left[mine]))]
                    out.append(TightBone(hand.name, names[number], name, float(left[least]), float(distance[least])))
        return out


def _bones_of(
    hand: FleshBody,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], list[str]]:
    quads = hand.mesh.quads(hand.hand.skin_faces)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    names = list(dict.fromkeys(digit_of_label(name) for name in hand.hand.segments))
    nodes = np.concatenate(hand.hand.bone_nodes).astype(np.int64)
    count = [len(one) for one in hand.hand.bone_nodes]
    digit = np.repeat([names.index(digit_of_label(name)) for name in hand.hand.segments], count)
    depth = -Facets(hand.mesh.nodes, triangles).project(hand.mesh.nodes[nodes]).distance
    some = np.flatnonzero(depth > _LEAST)
    return nodes[some], digit[some].astype(np.int64), depth[some], names
