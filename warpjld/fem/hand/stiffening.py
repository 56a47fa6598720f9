"""How far to go for a force, where it stiffens: from the force and its slope at one place, or at two.

F / F′ =: L is the way in which a force would grow by a factor e. It says how the force stiffens: constant where it
grows exponentially, as flesh does between bone and plate; in proportion to the way since the first touch, over n, where
it grows with a power n of it (springs 1, Hertz 1.5, thin pads 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["ForceSlope", "way_to"]

_POWERS = (1.0, 30.0)  # exponents allowed, from linear to a wall
_STIFFEST = 0.3
"""Least L, over the present one, that two places may foretell."""


@dataclass(frozen=True)
class ForceSlope:
    """A force, and its derivative by the way; both above 0."""

    force: float
    slope: float

    @property
    def way(self) -> float:
        """L."""
        return self.force / self.slope


def way_to(force: float, now: ForceSlope, other: ForceSlope | None = None, power: float = math.inf) -> float:
    """How much farther it is to a force, negative where it is less than the present one.

    Args:
        force: Wished, above 0.
        now: Where it begins.
        other: Another place, to tell how the force stiffens.
        power: n where there is none, or it does not tell; infinite: exponentially.
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
