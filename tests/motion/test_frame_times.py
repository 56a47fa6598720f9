"""Frames of key times as files keep them: rounded to float32, thinned out, at broadcast rates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.motion.frame_times import frame_rate, frame_times, merged_times

BROADCAST = [24000 / 1001, 30000 / 1001, 60000 / 1001, 23.976, 29.97, 59.94]
RATES = st.one_of(st.integers(24, 120).map(float), st.sampled_from(BROADCAST))
COMMON = [24.0, 25.0, 30.0, 50.0, 60.0, 120.0]


def single(times: np.ndarray) -> np.ndarray:
    return times.astype(np.float32).astype(np.float64)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(RATES, st.integers(2, 1000), st.floats(0.0, 100.0))
def test_no_frame_is_lost_or_added(rate: float, count: int, start: float) -> None:
    times = merged_times(single(start + np.arange(count) / rate))
    assert len(times) == count
    found = frame_rate(times)
    frames = frame_times(times[0], times[-1], found)
    assert len(frames) == count
    assert np.abs(frames - times).max() < 0.01 / rate
    assert frames[0] == times[0], "it starts when the file says"


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.integers(24, 120), st.integers(2, 1000), st.floats(0.0, 100.0))
def test_whole_rates_are_found_exactly(rate: int, count: int, start: float) -> None:
    if count / rate > 0.1 + start * 1e-2:  # else float32 itself leaves it open
        assert frame_rate(single(start + np.arange(count) / rate)) == rate


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.sampled_from(COMMON), st.sets(st.integers(1, 600), min_size=2, max_size=40))
def test_thinned_out_keys_lie_on_frames(rate: float, kept: set[int]) -> None:
    times = single(np.array([0, *sorted(kept)]) / rate)
    frames = frame_times(times[0], times[-1], frame_rate(times))
    assert np.abs(frames[:, None] - times).min(axis=0).max() < 0.01 / rate


@pytest.mark.parametrize("rate", [30.0, 60.0])
def test_times_in_whole_milliseconds_are_even(rate: float) -> None:
    times = np.round(np.arange(200) / rate, 3)
    assert frame_rate(times) == pytest.approx(rate, rel=1e-4)
    assert len(frame_times(times[0], times[-1], frame_rate(times))) == 200


def test_poses_seconds_apart_are_no_frames() -> None:
    assert frame_rate(np.array([0.0, 1.0])) == 30
    assert frame_rate(np.array([0.0, 0.5, 1.0, 1.5])) == 30
    assert frame_rate(np.array([0.0, 0.04, 0.2, 1.0])) == 25
    assert frame_rate(np.array([0.5])) == 30


def test_a_million_frames_are_the_most() -> None:
    with pytest.raises(InputError, match="the limit is 2,000,000"):
        frame_times(0.0, 1e6, 30.0)
