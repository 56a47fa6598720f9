"""What cannot work is refused before anything is solved."""

from __future__ import annotations

import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation
from warpjld.simulation.bodies.model import ContactModel, assemble_model
from warpjld.simulation.bodies.object_body import build_object_body
from warpjld.simulation.solve.checks import check_model
from warpjld.simulation.specification import GripSpecification

BALL = "OBJECT BALL BALL 0.024 AT 0.04 -0.05 -0.09\nPHYSICAL BALL ELEMENT 0.006\n"


def scene_with(text: str) -> tuple[ContactModel, Scene]:
    """Objects without a hand, and a wish to lift the ball."""
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(BALL + text)
    wish = GripSpecification("LEFT", "BALL", 1.0, 5.0, (), 0.1, lift=True, where=("hold.jld", 7, 1))
    scene.contact.grips.append(wish)
    staged = SceneAnimation(scene).objects
    objects = [build_object_body(staged[name], scene.contact, 0.0) for name in scene.contact.physical]
    obstacles = {name: one.obstacle(0.0) for name, one in staged.items() if name not in scene.contact.physical}
    return assemble_model([], objects, obstacles, scene.contact), scene


@pytest.mark.parametrize("extra", ["", "PHYSICAL TABLE ELEMENT 0.02\n"])
def test_what_stands_on_something_cannot_be_lifted(extra: str) -> None:
    model, scene = scene_with("OBJECT TABLE BOX 0.1 0.02 0.1 AT 0.04 -0.072 -0.09\n" + extra)
    with pytest.raises(InputError, match=r"hold\.jld.*7.*LIFT BALL: it stands on TABLE, which bears it"):
        check_model(model, scene.contact)


@pytest.mark.parametrize("place", ["0.04 -0.0725 -0.09", "0.04 -0.028 -0.09", "0.102 -0.05 -0.09"])
def test_what_is_half_a_millimetre_below_or_touches_elsewhere_is_no_matter(place: str) -> None:
    size = "0.1 0.02 0.1"
    model, scene = scene_with(f"OBJECT TABLE BOX {size} AT {place}\n")
    check_model(model, scene.contact)
