"""What cannot work is refused before anything is solved."""

from __future__ import annotations

import pytest

from warpjld.errors import InputError
from warpjld.simulation.bodies.model import Bodies, assemble
from warpjld.simulation.solve.checks import refuse_hopeless
from warpjld.simulation.specification import GripWish
from warpjld.script import Interpreter, Scene
from warpjld.script.press_bodies import object_body, prop_obstacle

BALL = "OBJECT BALL BALL 0.024 AT 0.04 -0.05 -0.09\nPHYSICAL BALL ELEMENT 0.006\n"


def staged(text: str) -> tuple[Bodies, Scene]:
    """Objects without a hand, and a wish to lift the ball."""
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(BALL + text)
    wish = GripWish("LEFT", "BALL", 1.0, 5.0, (), 0.1, lift=True, where=("hold.jld", 7, 1))
    scene.contact.grips.append(wish)
    rigid = [prop for prop in scene.props.values() if prop.name not in scene.contact.physical]
    objects = [object_body(scene, scene.prop(name), 0.0) for name in scene.contact.physical]
    obstacles = {prop.name: prop_obstacle(scene, prop, 0.0) for prop in rigid}
    return assemble([], objects, obstacles, scene.contact), scene


@pytest.mark.parametrize("extra", ["", "PHYSICAL TABLE ELEMENT 0.02\n"])
def test_what_stands_on_something_cannot_be_lifted(extra: str) -> None:
    bodies, scene = staged("OBJECT TABLE BOX 0.1 0.02 0.1 AT 0.04 -0.072 -0.09\n" + extra)
    with pytest.raises(InputError, match=r"hold\.jld.*7.*LIFT BALL: it stands on TABLE, which bears it"):
        refuse_hopeless(bodies, scene.contact)


@pytest.mark.parametrize("place", ["0.04 -0.0725 -0.09", "0.04 -0.028 -0.09", "0.102 -0.05 -0.09"])
def test_what_is_half_a_millimetre_below_or_touches_elsewhere_is_no_matter(place: str) -> None:
    size = "0.1 0.02 0.1"
    bodies, scene = staged(f"OBJECT TABLE BOX {size} AT {place}\n")
    refuse_hopeless(bodies, scene.contact)
