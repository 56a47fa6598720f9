"""Confidence intervals of success rates."""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

from warpjld.errors import InputError

__all__ = ["wilson_interval"]


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson score interval of a success rate.

    The rates p with |p̂ − p| ≤ z √(p (1 − p)/n), that is

        (p̂ + z²/2n ± z √(p̂ (1 − p̂)/n + z²/4n²)) / (1 + z²/n)

    (Wilson 1927, "Probable inference, the law of succession, and statistical inference", J. Am. Stat. Assoc. 22).
    Unlike p̂ ± z √(p̂(1 − p̂)/n) it is not empty at 0 or n successes, and stays within 0…1.

    Args:
        successes: Number of successes.
        trials: Number of trials, failures of any kind included; 0 gives (0, 1).
        confidence: Two-sided, between 0 and 1.

    Raises:
        InputError: More successes than trials, or a confidence out of range.
    """
    if not 0 <= successes <= trials:
        raise InputError(f"successes: want 0…{trials}, got {successes}")
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence: want a number between 0 and 1, got {confidence}")
    if trials == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
    rate, shrink = successes / trials, z * z / trials
    middle = (rate + shrink / 2.0) / (1.0 + shrink)
    half = z * sqrt(rate * (1.0 - rate) / trials + shrink / (4.0 * trials)) / (1.0 + shrink)
    # exact at the ends, where rounding would leave the bounds slightly off 0 and 1
    return (0.0 if successes == 0 else middle - half), (1.0 if successes == trials else middle + half)
