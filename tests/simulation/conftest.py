"""A hand on a stage, and scripts run on it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from warpjld.fem.hand import FleshHand, build_flesh_hand
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene


@pytest.fixture(scope="session")
def rig() -> Rig:
    """A left hand."""
    from warpjld.hand.kept import kept_hand

    return kept_hand("left", resolution=4000)


@pytest.fixture
def run(rig: Rig) -> Callable[[str], Scene]:
    """Runs lines on a stage with that hand."""
    scene = Scene(say=lambda text: None)
    scene.add("left", rig)
    interpreter = Interpreter(scene)

    def run_text(text: str) -> Scene:
        interpreter.run_text(text)
        return scene

    return run_text


@pytest.fixture(scope="session")
def hand(rig: Rig) -> FleshHand:
    """Its flesh, coarse."""
    return build_flesh_hand(rig, 0.004)
