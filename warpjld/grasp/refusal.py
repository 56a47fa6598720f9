"""Why a hand does not take an object: the unit of a file, the object, the hand, or none of them."""

from __future__ import annotations

from warpjld.errors import InputError
from warpjld.grasp.hand_scale import doubt_of_size, hand_length
from warpjld.grasp.random_placements import Draws

__all__ = ["fault_of", "refuse_what_is_too_wide"]

_SLACK = 1.2  # times what thumb and fingers span: what is wider everywhere is not tried
_FINGERTIP = 0.06  # of a hand's length: the breadth of a fingertip, below which pads find nothing to oppose on
_USUAL = 0.19  # a hand's length where none is known [m]


def refuse_what_is_too_wide(draws: Draws, friction: float) -> None:
    """Nothing where some part of the object fits between thumb and fingers.

    Raises:
        InputError: None does, with the object's width and theirs.
    """
    thing, widest = draws.near.thing, draws.widest
    if thing.size.min() <= _SLACK * widest:  # it costs to look closer, and next to none of these are
        return
    narrowest = draws.narrowest(friction)
    if narrowest > _SLACK * widest:
        doubt = doubt_of_size(thing, hand_length(draws.covering.skeleton), None)
        also = f"; it {doubt}" if doubt else "; two hands may take it (GRASP … BOTH … AUTO)"
        raise InputError(
            f"object {thing.name}: too wide for this hand: nowhere narrower than {1e3 * narrowest:.0f} mm, and thumb "
            f"and fingers open to {1e3 * widest:.0f} mm{also}"
        )


def fault_of(draws: Draws, friction: float) -> str:
    """What is at fault where no placement holds, and the sizes that say so.

    Args:
        draws: Placements of the first posture that was tried.
        friction: Coulomb coefficient.

    Examples:
        >>> import numpy as np
        >>> from warpjld.grasp.near_object import NearObject
        >>> from warpjld.grasp.obstacles import Obstacles
        >>> covering, pin = wj.bind(wj.build_hand("left", resolution=1500)), wj.shapes.ball(0.008)
        >>> near, none = NearObject(pin), Obstacles(covering, ())
        >>> draws = Draws(covering, near, none, "left", "pinch", np.random.default_rng(0))
        >>> fault_of(draws, 0.6).partition(":")[0]
        'the object is at fault'
    """
    thing, length = draws.near.thing, hand_length(draws.covering.skeleton)
    size, most = float(thing.size.max()), float((thing.size**2).sum() ** 0.5)
    narrowest, least, widest = draws.narrowest(friction), draws.least, draws.widest
    sizes = f"thumb and fingers open from {1e3 * least:.0f} to {1e3 * widest:.0f} mm"
    if doubt := doubt_of_size(thing, length, None):
        return f"the unit is at fault, it seems: the object {doubt}"
    if narrowest >= most:
        return f"the object is at fault: nowhere has it two opposite sides that this friction holds; {sizes}"
    sizes = f"the object is {1e3 * narrowest:.0f} mm wide where it is narrowest, {sizes}"
    if narrowest > widest:
        return f"the object is at fault: it is too wide for this hand; {sizes}"
    if size < _FINGERTIP * (length or _USUAL):
        return f"the object is at fault: it is smaller than a fingertip, {1e3 * size:.1f} mm at its longest; {sizes}"
    if least > most:
        return f"the hand is at fault: its thumb and fingers do not close far enough; {sizes}"
    return f"neither hand, object nor unit is at fault by its size ({sizes}): more placements or friction may do"
