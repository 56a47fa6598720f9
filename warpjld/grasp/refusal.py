"""Diagnosis of a failed grasp search: the file's unit, the object, the hand, or none of them is the cause."""

from __future__ import annotations

from warpjld.errors import InputError
from warpjld.grasp.hand_scale import doubt_of_size, hand_length
from warpjld.grasp.random_placements import Draws

__all__ = ["fault_of", "refuse_what_is_too_wide"]

_SLACK = 1.2  # an object wider everywhere than this multiple of the widest opening of thumb and fingers is not tried
_FINGERTIP = 0.06  # breadth of a fingertip over the hand's length; pads find no opposite sides on smaller objects
_USUAL = 0.19  # length of a hand where it is unknown [m]


def refuse_what_is_too_wide(draws: Draws, friction: float) -> None:
    """Check that some part of the object fits between thumb and fingers.

    Args:
        draws: Random placements of the object.
        friction: Coulomb coefficient.

    Raises:
        InputError: No part does; states the object's least width and the widest opening.
    """
    thing, widest = draws.near.thing, draws.widest
    if thing.size.min() <= _SLACK * widest:  # skip the costly measurement of the least width; these are rarely too wide
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
    """Describe the likely cause, with sizes, when no placement yields a grasp.

    Args:
        draws: Random placements for the first posture that was tried.
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
        return f"the object is at fault: it has no two opposite sides that this friction could hold; {sizes}"
    sizes = f"the object is {1e3 * narrowest:.0f} mm wide where it is narrowest, {sizes}"
    if narrowest > widest:
        return f"the object is at fault: it is too wide for this hand; {sizes}"
    if size < _FINGERTIP * (length or _USUAL):
        return f"the object is at fault: it is smaller than a fingertip, {1e3 * size:.1f} mm at its longest; {sizes}"
    if least > most:
        return f"the hand is at fault: its thumb and fingers do not close far enough; {sizes}"
    return f"neither hand, object nor unit is at fault by its size ({sizes}): more placements or friction may do"
