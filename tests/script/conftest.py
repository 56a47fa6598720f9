"""A way to run a script on a coarse hand."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene


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
