"""How far digits close before they touch: found from distances of flesh that moves with its bones."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.fem.contact.obstacles.solids import Sphere
from warpjld.simulation.bodies.model import PairOwners
from warpjld.simulation.grip.touch_room import touch_room

BEGIN = {"thumb": 0.013, "index": 0.021, "middle": 0.01, "ring": 0.3, "palm": 0.01}
"""Height of each part above the middle of a ball of 10 mm radius [m]."""
OFFSET = 1e-3
"""Height of the visible skin above the mesh [m]."""


@dataclass(frozen=True)
class Start:
    """Rest of bones: motions are numbers, how far parts have sunk [m]."""

    def to(self, moves: float) -> float:
        return moves


def hand_over_ball(sunk: float = 0.0) -> tuple[Any, Any]:
    """A hand whose parts sink by 0.1 m per rad onto a ball, the palm excepted; and a model of both."""
    names = np.array(list(BEGIN))
    nodes = np.array([[0.0, 0.0, height] for height in BEGIN.values()])
    mesh = SimpleNamespace(nodes=nodes, face_set=lambda name: name, quads=lambda faces: np.arange(5))
    sinks = np.where(names == "palm", 0.0, 1.0)[:, None] * [0.0, 0.0, -1.0]
    hand = SimpleNamespace(
        name="LEFT",
        mesh=mesh,
        faces="skin",
        node_digits=names,
        shape=SimpleNamespace(start=Start()),
        moves=lambda time: sunk,
        bones=SimpleNamespace(moves_of=lambda angles, time: sunk + 0.1 * float(angles[0, 0])),
        hand=SimpleNamespace(guess=lambda first, after, before: before + (after - first) * sinks),
    )
    pair = SimpleNamespace(master=Sphere(np.zeros(3), 0.01), offset=np.full(5, OFFSET))
    model = SimpleNamespace(pairs=(pair,), owners=(PairOwners("LEFT", "BALL"),), spans={"LEFT": slice(0, 5)})
    return hand, model


def room(most: float, displacement: float = 0.0) -> dict[str, float]:
    hand, model = hand_over_ball()
    moved = np.tile([0.0, 0.0, displacement], (5, 1))
    return touch_room(model, hand, moved, 0.0, lambda by: np.array([[by]]), most)


def test_each_digit_touches_where_its_skin_meets_the_object() -> None:
    found = room(0.35)
    assert found.keys() == {"thumb", "index", "middle"}  # the ring finger is too far, the palm does not close
    for digit in ("thumb", "index"):
        expected = (BEGIN[digit] - 0.01 - OFFSET) / 0.1
        assert expected <= found[digit] < expected + np.radians(0.03)
    assert found["middle"] == 0.0


def test_it_begins_at_the_equilibrium() -> None:
    """Flesh that has risen by 2 mm has as much farther to go."""
    assert room(0.35, 2e-3)["index"] - room(0.35)["index"] == pytest.approx(0.02, abs=np.radians(0.03))


def test_what_is_not_reached_is_left_out() -> None:
    assert room(0.05).keys() == {"thumb", "middle"}
