"""What a scene asks of grips and corrections and cannot have, found before anything is meshed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.specification import placed
from warpjld.simulation.specification import ContactWishes, GripWish, Pressing

if TYPE_CHECKING:
    from warpjld.script.scene import Scene

__all__ = ["check_wishes"]


def check_wishes(scene: Scene, pressing: Pressing) -> None:
    """Refuse grips and corrections that cannot be.

    Raises:
        InputError: Names the command's line.
    """
    wishes = scene.contact
    begun = set()
    for wish in wishes.grips:
        try:
            _check_grip(wishes, wish, pressing)
            if wish.first in begun:
                raise InputError(f"another grip begins at frame {wish.first:g}")
        except InputError as error:
            raise placed(error, wish.where) from None
        begun.add(wish.first)
    if pressing.state is not None and (wishes.grips or pressing.correct):
        raise InputError("STATE keeps no grips and no corrections: leave it out")
    if pressing.correct and pressing.method == "paper":
        raise InputError("CORRECT goes on from the frame before: the paper's method cannot")
    recorded = [name for name in wishes.flesh if scene.actor(name).recorded is not None]
    if pressing.correct and recorded:
        raise InputError(f"actor {recorded[0]} is driven by a MOTION file: no angle can be corrected")


def _check_grip(wishes: ContactWishes, wish: GripWish, pressing: Pressing) -> None:
    if wish.actor not in wishes.flesh:
        raise InputError(f"{wish.actor} has no flesh that deforms: FLESH {wish.actor} makes it so")
    if wish.first <= pressing.first or wish.last > pressing.last:
        span = f"after {pressing.first} and up to {pressing.last}"
        raise InputError(f"its frames must lie in those of PRESS, {span}, got {wish.first:g} to {wish.last:g}")
    if pressing.method == "paper":
        raise InputError("a grip cannot be searched for by the paper's method, which knows no friction")
    if not wish.lift:
        return
    if np.count_nonzero(wishes.pull) != 1:
        x, y, z = wishes.pull
        raise InputError(f"LIFT wants a GRAVITY along one axis of the stage, got {x:g} {y:g} {z:g}")
    bonded = next((b for b in wishes.bonds if wish.object in (b.one, b.other)), None)
    if bonded is not None:
        other = bonded.other if bonded.one == wish.object else bonded.one
        raise InputError(f"LIFT takes the weight of one object, and {wish.object} is bonded to {other}")
    if any(state.tracks for (name, _), state in wishes.prescribed.items() if name == wish.object):
        raise InputError("LIFT wants an object that nothing but HOLD keeps in its place: no VECTOR and no PARTIAL")
    if wish.weight is None and not wishes.physical[wish.object].density > 0.0:
        raise InputError(f"{wish.object} weighs nothing: give it a DENSITY, or LIFT it with a WEIGHT")
