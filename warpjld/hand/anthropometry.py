"""Percentiles of hand length and breadth in a population, for `build_hand(**percentile(50, "female"))`."""

from __future__ import annotations

from statistics import NormalDist

from warpjld.errors import InputError

__all__ = ["percentile"]

# mean and standard deviation [m] of hand length and hand breadth: U.S. Army personnel, 1774 men and 2208 women,
# C. C. Gordon et al., 1988 Anthropometric Survey, NATICK/TR-89/044, rounded to a millimetre
_SURVEY = {
    "male": {"length": NormalDist(0.194, 0.010), "breadth": NormalDist(0.090, 0.004)},
    "female": {"length": NormalDist(0.180, 0.010), "breadth": NormalDist(0.079, 0.004)},
}


def percentile(percent: float, sex: str) -> dict[str, float]:
    """Length and breadth [m] that ``percent`` of adults of this sex do not exceed, from a normal distribution.

    Both are taken at the same percentile: a hand that is large in all directions.

    Args:
        percent: Between 0 and 100, both excluded.
        sex: "male" or "female".

    Raises:
        InputError: A percentage out of range, or another sex than the survey's.
    """
    if sex not in _SURVEY:
        raise InputError(f"sex: the survey has 'male' and 'female', got {sex!r}")
    if not 0.0 < percent < 100.0:
        raise InputError(f"percent: want a number between 0 and 100, got {percent!r}")
    return {name: spread.inv_cdf(percent / 100.0) for name, spread in _SURVEY[sex].items()}
