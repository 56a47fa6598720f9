"""How far digits may bend on before their bones are inside an object that cannot give way.

A search that bends digits on asks for equilibria in which flesh of coarse elements, pressed between points of contact,
lets a bone come into the object. A frame refuses such a pose (``BoneClearance``): what a search finds must be a pose
that frames accept.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.bone_clearance import BoneClearance

__all__ = ["bone_room"]

_STEP = math.radians(1.0)
"""Interval of the closings that are looked at [rad]: a fingertip moves by 1.5 mm."""
_HALVINGS = 7
"""Halvings of that interval: to 0.01 degrees, 0.01 mm at a fingertip."""


def bone_room(
    model: ContactModel, hand: FleshBody, time: float, closed: Callable[[float], NDArray[np.float64]], most: float
) -> dict[str, float]:
    """Largest closing of each digit at which its bones are outside every object [rad], where that is below ``most``.

    Args:
        model: The contact model; its objects stay as they are at ``time``.
        hand: The hand that closes; it has to be driven by joint angles.
        time: Time of the equilibrium from which it closes [frames].
        closed: Joint angles (J, 4) at a closing.
        most: Largest closing [rad].

    Returns:
        Closings by digit, such as ``index``.
    """
    clearance = BoneClearance(model)

    def inside(closing: float) -> set[str]:
        moves = hand.bones.moves_of(closed(closing), time)
        posed = replace(hand, moves=lambda _: moves)
        aside = replace(model, hands=tuple(posed if one.name == hand.name else one for one in model.hands))
        return {one.digit for one in clearance.nearest(aside, time) if one.actor == hand.name and one.left <= 0.0}

    room: dict[str, float] = {}
    before, looks = 0.0, max(1, math.ceil(most / _STEP))
    for closing in (most * (k + 1) / looks for k in range(looks)):
        for digit in inside(closing) - room.keys():
            low, high = before, closing
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if digit in inside(middle) else (middle, high)
            room[digit] = low
        before = closing
    return room
