"""A digit that has stopped and lags behind its animation goes on when its load has dropped, and stops again in time."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.rig import Rig
from warpjld.simulation.solve import force_limit
from warpjld.simulation.solve.digit_caps import closing_joints
from warpjld.simulation.solve.digit_loads import DigitLoad
from warpjld.simulation.solve.force_limit import ForceLimits
from warpjld.skeleton.channels import FLEXION

DIGIT = "left.index"


@dataclass(frozen=True)
class Bones:
    """Of an index finger whose joints close by 0.1 rad a frame."""

    skeleton: Any
    bendable = True

    def angles(self, time: float) -> np.ndarray:
        out = np.zeros((len(self.skeleton.names), 4))
        out[closing_joints(self.skeleton)[DIGIT], FLEXION] = 0.1 * time
        return out

    def moves_of(self, angles: np.ndarray, time: float) -> np.ndarray:
        return angles


@dataclass(frozen=True)
class Hand:
    name: str
    bones: Bones
    moves: Any = None


@dataclass(frozen=True)
class Model:
    hands: tuple[Hand, ...]
    start: float = 0.0


@pytest.mark.parametrize("power", [2.0, 0.5])
def test_it_ends_at_its_limit(rig: Rig, monkeypatch: pytest.MonkeyPatch, power: float) -> None:
    """Its load is a power of its flexion over what it may be, which doubles after three frames; a chord of loads that
    grow ever slower lies beyond the limit, as where another digit presses from the other side."""
    joint = closing_joints(rig.skeleton)[DIGIT][0]
    solved: list[tuple[float, float]] = []

    def most(time: float) -> float:
        return 0.15 if time <= 3.0 else 0.30

    def onward(model: Model, history: Any, before: Any, times: list[float], **_: Any) -> Any:
        moves = model.hands[0].moves or model.hands[0].bones.angles
        solved.append((times[-1], float(moves(times[-1])[joint, FLEXION])))
        last = SimpleNamespace(time=times[-1])
        return SimpleNamespace(converged=True, last=last, instants=(last,))

    def loads(model: Model, hand: Hand, angles: np.ndarray, instant: Any, *_: Any) -> dict[str, DigitLoad]:
        share = float(angles[joint, FLEXION] / most(instant.time)) ** power
        return {DIGIT: DigitLoad(hand.name, DIGIT, 1.0, share, 0.0)}

    monkeypatch.setattr(force_limit, "solve_onward", onward)
    monkeypatch.setattr(force_limit, "digit_loads", loads)
    monkeypatch.setattr(force_limit, "replace", lambda one, **new: type(one)(**(vars(one) | new)))
    nothing: dict[str, Any] = {"nearest": lambda model, time: [], "between_digits": lambda model, time: []}
    clear = SimpleNamespace(**nothing, inside=lambda model, time: None)
    limits = ForceLimits({}, 3e5, {}, clear)  # type: ignore[arg-type]
    model, before, reached = Model((Hand("LEFT", Bones(rig.skeleton)),)), None, {}
    for frame in range(1, 7):
        limits._step(model, None, before, frame - 1.0, float(frame))  # type: ignore[arg-type]
        before, reached[frame] = None, solved[-1][1]
    for frame, flexion in reached.items():
        assert flexion <= most(frame) * (1.0 + 1e-9)
    assert reached[3] > 0.7 * 0.15
    assert reached[6] > 0.7 * 0.30  # it went on, from where it was
    flexions = [reached[frame] for frame in sorted(reached)]
    assert flexions == sorted(flexions)  # and never opened
    assert len(set(solved)) == len(solved)  # no equilibrium was found twice
    assert len(solved) <= 4 * len(reached)
