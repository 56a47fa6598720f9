"""The firmest grip at which an object is balanced: between grips whose balance is known."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from warpjld.simulation.grip import opposed as module
from warpjld.simulation.grip.opposed import firmest_opposed


class Squeeze:
    """Grips, solved up to ``solvable``; ``closed`` gives the grip itself as its equilibrium."""

    model = None

    def __init__(self, known: list[float], solvable: float = math.inf) -> None:
        self.known, self.solved, self._solvable = sorted(known), list[float](), solvable

    def closed(self, grip: float) -> Any:
        if grip not in self.known:
            self.solved.append(grip)
        return SimpleNamespace(converged=grip <= self._solvable, last=grip)


@pytest.fixture
def left_over(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[float], float]], None]:
    """Makes what is left over on the object, relative to what is allowed, a function of the grip."""

    def make(ratio: Callable[[float], float]) -> None:
        monkeypatch.setattr(module, "worst_opposed", lambda _, grip, name: SimpleNamespace(net=ratio(grip)))
        monkeypatch.setattr(module, "allowed_left", lambda balance: 1.0)

    return make


def firmest(squeeze: Squeeze, high: float) -> float:
    return firmest_opposed(squeeze, "BALL", high, lambda line: None)  # type: ignore[arg-type]


@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_a_few_grips_come_near_what_is_allowed(
    power: float, left_over: Callable[[Callable[[float], float]], None]
) -> None:
    left_over(lambda grip: 3.0 * grip**power)
    squeeze = Squeeze([0.0, 0.2, 1.0])
    found = firmest(squeeze, 1.0)
    assert 0.75 <= 3.0 * found**power <= 1.0
    assert len(squeeze.solved) <= 4


def test_what_is_known_to_be_near_enough_is_taken(left_over: Callable[[Callable[[float], float]], None]) -> None:
    left_over(lambda grip: 3.0 * grip)
    squeeze = Squeeze([0.0, 0.31, 0.5])
    assert firmest(squeeze, 0.5) == 0.31
    assert squeeze.solved == []


def test_a_firmer_grip_beyond_an_unbalanced_one_is_not_taken(
    left_over: Callable[[Callable[[float], float]], None],
) -> None:
    """Digits cannot pass a grip that pushes the object away."""
    left_over(lambda grip: 2.0 if 0.2 < grip < 0.4 else 0.95)
    assert firmest(Squeeze([0.0, 0.1, 0.3, 0.5]), 0.5) == pytest.approx(0.1)


def test_without_any_it_does_not_close(left_over: Callable[[Callable[[float], float]], None]) -> None:
    left_over(lambda grip: 2.0)
    assert firmest(Squeeze([0.0, 0.5]), 0.5) == 0.0


def test_grips_without_an_equilibrium_count_as_unbalanced(
    left_over: Callable[[Callable[[float], float]], None],
) -> None:
    left_over(lambda grip: 0.5 if grip < 0.9 else 2.0)
    found = firmest(Squeeze([0.0, 1.0], solvable=0.3), 1.0)
    assert 0.0 < found <= 0.3
