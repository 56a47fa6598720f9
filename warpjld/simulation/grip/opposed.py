"""Firmest grip whose forces on a rigid object oppose one another (R112, R123).

The placement of a rigid object is prescribed and bears whatever force is left over, so that digits can press it with
any force against nothing. A hand cannot: what is not opposed pushes the object away. Where no closings balance a force
that is asked for, the digits close as far as what they press with is opposed, and the search says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from warpjld.fem.contact import ContactInstant
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.simulation.report.balance import ObjectBalance, balances
from warpjld.simulation.solve.grasp_balance import allowed_net
from warpjld.simulation.solve.solved_frame import solved_frame

__all__ = ["allowed_left", "firmest_allowed", "firmest_opposed", "left_ratio", "worst_opposed"]

_ROUNDS = 4
"""Most further grips solved."""
_NEAR = 0.9
"""What is left over, relative to what is allowed, from which on a balanced grip is firm enough."""
_AIM = 0.95
"""The same at which the search aims."""
_INSIDE = 0.1
"""Least distance of the next grip from both ends of the interval, over its length."""


def worst_opposed(model: ContactModel, instant: ContactInstant, name: str = "") -> ObjectBalance | None:
    """Balance of the unbalanced rigid object with the largest resultant among those that only hands touch, or of the
    named one whether it is balanced or not."""
    rigid = [one for one in balances(model, solved_frame(model.start + instant.time, [instant])) if one.by_hands]
    rigid = [one for one in rigid if one.object in model.obstacles and (one.object == name or not _opposed(one))]
    return max(rigid, key=lambda one: one.net, default=None)


def allowed_left(balance: ObjectBalance) -> float:
    """Resultant up to which an object counts as balanced [N]."""
    return allowed_net(balance.pressing, balance.weight)


def _opposed(balance: ObjectBalance) -> bool:
    return balance.net <= allowed_left(balance)


def firmest_opposed(squeeze: Squeeze, name: str, high: float, tell: Callable[[str], None]) -> float:
    """Largest known or found grip up to ``high`` [rad] below which a rigid object is balanced; 0 if it never is.

    Args:
        squeeze: Equal closings, of which some are known.
        name: The object.
        high: A grip at which it is not balanced [rad].
        tell: Called with a line about every grip.
    """

    def ratio(grip: float) -> float:
        closed = squeeze.closed(grip)
        return left_ratio(squeeze.model, closed.last if closed.converged else None, name)

    def say(grip: float, found: float) -> None:
        tell(f"{math.degrees(grip):.2f}°: {found:.2f} of what may be left over on {name}")

    return firmest_allowed(ratio, [grip for grip in squeeze.known if grip <= high], high, say)


def left_ratio(model: ContactModel, instant: ContactInstant | None, name: str) -> float:
    """What is left over on a rigid object, relative to what is allowed; infinite without an equilibrium."""
    if instant is None:
        return math.inf
    balance = worst_opposed(model, instant, name)
    return 0.0 if balance is None else balance.net / allowed_left(balance)


def firmest_allowed(
    ratio: Callable[[float], float], grips: Sequence[float], high: float, tell: Callable[[float, float], None]
) -> float:
    """Largest known or found grip up to ``high`` below which what is left over is allowed; 0 if it never is.

    Args:
        ratio: What is left over at a grip, relative to what is allowed; infinite if contact is not solved there.
        grips: Grips that are known, ascending.
        high: A grip at which it is too much.
        tell: Called with a grip and its ratio.
    """
    known = [(grip, ratio(grip)) for grip in grips]
    over = [one for one in known if one[1] > 1.0] or [(high, math.inf)]
    above = over[0]
    below = max((one for one in known if one[0] < above[0]), default=None)
    if below is None:
        return 0.0
    for _ in range(_ROUNDS):
        if below[1] >= _NEAR:
            break
        root, rise = math.sqrt(below[1]), math.sqrt(above[1]) - math.sqrt(below[1])  # forces grow with the square
        share = (math.sqrt(_AIM) - root) / rise if math.isfinite(rise) else 0.5
        grip = below[0] + min(max(share, _INSIDE), 1.0 - _INSIDE) * (above[0] - below[0])
        found = grip, ratio(grip)
        tell(*found)
        below, above = (found, above) if found[1] <= 1.0 else (below, found)
    return below[0]
