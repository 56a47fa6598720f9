"""How far digits may bend before their bones are inside an object: found for each alone, by looks and halvings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.simulation.grip import bone_room as module
from warpjld.simulation.grip.bone_room import bone_room
from warpjld.simulation.solve.bone_clearance import TightBone


@dataclass(frozen=True)
class Hand:
    name: str
    moves: Callable[[float], float]
    bones: Any = None


@dataclass(frozen=True)
class Model:
    hands: tuple[Hand, ...]


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> Model:
    """Two hands; bones of one reach an object at .1 and .2517 rad, and flesh of its pinky is merely thin."""

    class Clearance:
        def __init__(self, model: Model) -> None:
            pass

        def nearest(self, model: Model, time: float) -> list[TightBone]:
            left, right = (hand.moves(time) for hand in model.hands)
            assert right == 9.0  # stays as it is
            tight = [("index", 0.1 - left), ("middle", 0.2517 - left), ("pinky", 0.01)]
            return [TightBone("LEFT", digit, "CAN", gap, gap) for digit, gap in tight if gap < 1.0] + [
                TightBone("RIGHT", "ring", "CAN", -1.0, -1.0)
            ]

    monkeypatch.setattr(module, "BoneClearance", Clearance)
    bones = SimpleNamespace(moves_of=lambda angles, time: float(angles[0, 0]))
    return Model((Hand("LEFT", lambda time: -1.0, bones), Hand("RIGHT", lambda time: 9.0)))


def room(model: Model, most: float) -> dict[str, float]:
    return bone_room(model, model.hands[0], 3.0, lambda by: np.array([[by]]), most)  # type: ignore[arg-type]


def test_each_digit_stops_just_before_its_bone_is_inside(model: Model) -> None:
    found = room(model, 0.35)
    assert found.keys() == {"index", "middle"}
    for digit, reached in (("index", 0.1), ("middle", 0.2517)):
        assert reached - np.radians(0.01) < found[digit] < reached


def test_digits_with_room_are_not_named(model: Model) -> None:
    assert room(model, 0.2).keys() == {"index"}
    assert room(model, 0.05) == {}
