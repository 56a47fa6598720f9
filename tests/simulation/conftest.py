"""A hand on a stage, and scripts run on it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from warpjld.fem.hand import FleshHand, build_flesh_hand
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene


@pytest.fixture(scope="session")
def rig() -> Rig:
    """A left hand, coarse."""
    from warpjld.hand.kept import kept_hand

    return kept_hand("left", resolution=4000)


@pytest.fixture(scope="session")
def fine() -> Rig:
    """A left hand with as many vertices as usual."""
    from warpjld.hand.kept import kept_hand

    return kept_hand("left")


@pytest.fixture
def run(request: pytest.FixtureRequest) -> Callable[[str], Scene]:
    """Runs lines on a stage with a left hand: coarse where the test is quick."""
    scene = Scene(say=lambda text: None)
    slow = request.node.get_closest_marker("slow") is not None
    scene.add("left", request.getfixturevalue("fine" if slow else "rig"))
    interpreter = Interpreter(scene)

    def run_text(text: str) -> Scene:
        interpreter.run_text(text)
        return scene

    return run_text


@pytest.fixture(scope="session")
def hand(rig: Rig) -> FleshHand:
    """Its flesh, coarse."""
    return build_flesh_hand(rig, 0.004)
