"""A coarse hand, and a way to run a script on it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from warpjld.hand import build_hand
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene


@pytest.fixture(scope="session")
def hands() -> dict[str, Rig]:
    """Coarse built-in hands by side."""
    return {side: build_hand(side, resolution=1500) for side in ("left", "right")}


@pytest.fixture
def scene(hands: dict[str, Rig]) -> Scene:
    """A left hand on stage; what it says is in ``scene.said``."""
    scene = Scene()
    scene.add("left", hands["left"])
    scene.said = []  # type: ignore[attr-defined]
    scene.say = scene.said.append  # type: ignore[attr-defined]
    return scene


@pytest.fixture
def run(scene: Scene) -> Callable[[str], Scene]:
    """Runs a script on that scene."""
    interpreter = Interpreter(scene)

    def run_text(text: str) -> Scene:
        interpreter.run_text(text)
        return scene

    return run_text
