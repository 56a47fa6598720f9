"""Whether a grip that a search found is the gentlest: it is tried again with less force."""

from __future__ import annotations

import math
from typing import Any

import pytest

from warpjld.simulation.grip.hand_trials import HandTrials
from warpjld.simulation.grip.search import Trial

__all__ = ["gentler", "watched"]


def watched(monkeypatch: pytest.MonkeyPatch) -> list[HandTrials]:
    """The trials of every ``LIFT`` from now on."""
    made: list[HandTrials] = []

    class Watched(HandTrials):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            made.append(self)

    monkeypatch.setattr("warpjld.simulation.grip.find.HandTrials", Watched)
    return made


def gentler(trials: HandTrials, grip: float, share: float) -> tuple[Trial, float]:
    """Trial of the grip that presses, before the weight is on, with a share of the force of another grip [rad]; and the
    share with which it does."""
    rate, firm = trials.rate(grip), trials.weight.force(trials.closed(grip).last)
    assert rate is not None
    trial = trials(grip + math.log(share) / rate)
    return trial, trial.pressed / firm
