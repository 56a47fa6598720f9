"""Extrapolation of the displacement at which a stiffening force reaches a value, from one or two known states.

F / F′ =: L is the displacement over which the force would grow by a factor e. Its change characterises the stiffening:
L is constant for an exponential force, as of flesh between bone and plate; it is the displacement since first contact
over n for a force that grows with its power n (springs 1, Hertz 1.5, thin pads 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["ForceSlope", "way_to"]

_POWERS = (1.0, 30.0)  # range of exponents, from linear to nearly rigid
_STIFFEST = 0.3
"""Smallest extrapolated L, per present L."""


@dataclass(frozen=True)
class ForceSlope:
    """A force, and its derivative with respect to displacement; both above 0."""

    force: float
    slope: float

    @property
    def way(self) -> float:
        """L, force over slope."""
        return self.force / self.slope


def way_to(force: float, now: ForceSlope, other: ForceSlope | None = None, power: float = math.inf) -> float:
    """Displacement from the present force to a wanted one, negative if that is smaller.

    Args:
        force: Wanted force, above 0.
        now: Present state.
        other: Another state, to estimate the stiffening.
        power: Exponent n if there is no other state, or it is not conclusive; infinite for exponential growth.
    """
    grows = math.log(force / now.force)
    if other is not None:
        apart = math.log(now.force / other.force)
        bends = math.log(now.way / other.way)
        if abs(apart) > 1e-3:
            if bends * apart > 1e-6:
                power = min(max(apart / bends, _POWERS[0]), _POWERS[1])
            else:
                mean = now.way + 0.5 * grows * (now.way - other.way) / apart
                return max(mean, _STIFFEST * now.way) * grows
    if math.isinf(power):
        return now.way * grows
    return power * now.way * (math.exp(grows / power) - 1.0)
