"""Wilson intervals against SciPy's, and what they must do at the ends."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from warpjld.errors import InputError
from warpjld.study import wilson_interval


@given(trials=st.integers(1, 5000), share=st.floats(0.0, 1.0), confidence=st.floats(0.5, 0.999))
def test_agrees_with_scipy(trials: int, share: float, confidence: float) -> None:
    successes = round(share * trials)
    exact = binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    low, high = wilson_interval(successes, trials, confidence)
    assert low == pytest.approx(exact.low, abs=1e-12)
    assert high == pytest.approx(exact.high, abs=1e-12)
    assert 0.0 <= low <= successes / trials <= high <= 1.0


def test_ten_of_ten_is_not_certain() -> None:
    """z²/(n + z²) is what ten failures leave of a rate: 3.8415/13.8415."""
    assert wilson_interval(0, 10) == (0.0, pytest.approx(0.27753, abs=1e-5))
    assert wilson_interval(10, 10) == (pytest.approx(0.72247, abs=1e-5), 1.0)
    assert wilson_interval(0, 0) == (0.0, 1.0)


def test_more_successes_than_trials_are_refused() -> None:
    with pytest.raises(InputError, match="successes"):
        wilson_interval(3, 2)
    with pytest.raises(InputError, match="confidence"):
        wilson_interval(1, 2, 1.0)
