"""A hand that bones drive, as contact takes it (R110)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Body, Material, Prescribed
from warpjld.fem.hand.alone import FleshAlone
from warpjld.fem.hand.blend import Moves
from warpjld.simulation.bodies.flesh_body import Drive
from warpjld.simulation.bodies.rest_shape import Part
from warpjld.simulation.bodies.skin_parts import SkinParts

__all__ = ["WORN", "HandBody"]

WORN = 0.5
"""Share of the flesh in skin from which on it has flesh to give way with."""


@dataclass(frozen=True, eq=False)
class HandBody:
    """A hand that is driven by its bones.

    Attributes:
        name: Of the actor.
        part: Its flesh at time 0.
        laws: By region.
        moves: Motions of its bones from the rig's rest at a time.
        softness: Young's modulus of its skin [Pa].
        itself: Whether its skin may touch itself.
        drive: What moves them, for searches that bend its joints otherwise.
        parts: Of its visible skin.
    """

    name: str
    part: Part
    laws: Mapping[str, Material]
    moves: Callable[[float], Moves]
    softness: float
    itself: bool
    drive: Drive
    parts: SkinParts

    def worn(self, part: str) -> bool:
        """Whether most of a digit's skin, or the palm's, has flesh to give way with."""
        mine = self.parts.part_of[self.parts.labels] == self.parts.names.index(part)
        return bool((self.part.blend[mine] > WORN).mean() > 0.5)

    def prescribed(self, time: float) -> Prescribed:
        """Displacements of the bones' nodes and of those where the flesh was cut off."""
        hand, cut = self.part.hand, self.part.cut
        moves = self.part.start.to(self.moves(time))
        known = hand.prescribed_by(moves)
        cut = np.setdiff1d(cut, known.degrees[::3] // 3)
        if not len(cut):
            return known
        x = hand.mesh.nodes[cut]
        return known + _whole(cut, moves.blended(hand.weights[cut], x) - x)

    def guess(self, before: float, time: float, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """First guess of a displacement (N, 3) from that at an earlier time."""
        start = self.part.start
        return self.part.hand.guess(start.to(self.moves(before)), start.to(self.moves(time)), displacement)

    @cached_property
    def alone(self) -> FleshAlone:
        """Its flesh without what touches it."""
        hand = self.part.hand
        return FleshAlone(hand, Body(hand.mesh, self.laws), self.prescribed(0.0).degrees, self.drive.pose(0.0))


def _whole(nodes: NDArray[np.int64], moved: NDArray[np.float64]) -> Prescribed:
    """All three displacements of nodes."""
    order = np.argsort(nodes)
    degrees = (3 * nodes[order][:, None] + np.arange(3)).ravel()
    return Prescribed(degrees, moved[order].ravel())
