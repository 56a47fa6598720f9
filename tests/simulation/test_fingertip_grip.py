"""Two fingertips hold a block by its sides: each has to press with W / 2μ, which is known (R123)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warpjld.fem import Body, HexMesh, LinearElastic, Prescribed, box_hexes, merge, prescribe
from warpjld.fem.contact import Pair
from warpjld.fem.hand import hand_laws
from warpjld.fem.hand.fingertip import Fingertip, build_fingertip
from warpjld.rig import Rig
from warpjld.simulation.grip.prescribed_trials import PrescribedTrials
from warpjld.simulation.grip.search import GripStatus, gentlest_grip

WEIGHT, EDGE = 0.5, 0.02
MIRRORED = np.array([1, 0, 3, 2, 5, 4, 7, 6])
"""Order of an element's corners in the mirror image of its mesh."""
MIRRORED_FACES = np.array([1, 0, 2, 3, 4, 5], np.int32)
PRESSED_AT = {0.3: -0.8e-3, 0.6: 0.0, 0.9: 0.0}
"""Where pads press along y once the block hangs between them, by friction [m]: its centre lies there, or it turns about
the pads, and friction bears a moment as well."""


@pytest.fixture(scope="module")
def tip(fine: Rig) -> Fingertip:
    return build_fingertip(fine, "index", 0.003)


def beside(tip: Fingertip, side: str, sign: float) -> HexMesh:
    """A tip that lies level, its pad against the block's side x = ± EDGE / 2; right and left are mirror images.

    Pads that press at different heights would turn the block, and then bear unequal shares of its weight.
    """
    out, along = tip.facing(np.radians(20.0)), tip.along
    along = along - (along @ out) * out
    along /= np.linalg.norm(along)
    # the pad faces the block, the finger points along y, what was across lies along z: gravity is across
    frame = np.stack([out, along, np.cross(out, along)])
    nodes = (tip.mesh.nodes - tip.joint) @ frame.T
    nodes -= nodes[int(np.argmax(nodes[:, 0]))] + [0.5 * EDGE, 0.0, 0.0]
    elements, skin = tip.mesh.elements, tip.mesh.faces["tip"]
    if sign > 0.0:
        nodes, elements = nodes * [-1.0, 1.0, 1.0], elements[:, MIRRORED]
        skin = np.stack([skin[:, 0], MIRRORED_FACES[skin[:, 1]]], axis=1)
    return replace(
        tip.mesh,
        nodes=nodes,
        elements=elements,
        region_names=tuple(f"{side}.{name.partition('.')[2]}" for name in tip.mesh.region_names),
        faces={f"{side}.skin": skin},
        node_sets={f"{side}.held": tip.mesh.node_sets["held"]},
    )


def tips_and_block(tip: Fingertip, friction: float) -> PrescribedTrials:
    """A grip is the way [m] by which each tip closes."""
    half = 0.5 * EDGE
    block = box_hexes(
        (EDGE, EDGE, EDGE), (4, 4, 4), origin=(-half, PRESSED_AT[friction] - half, -half - 0.002), name="block"
    )
    block = replace(block, faces={f"block.{side}": faces for side, faces in block.faces.items()})
    mesh = merge(block, beside(tip, "left", -1.0), beside(tip, "right", 1.0))
    stuff = LinearElastic(1e6, 0.3, density=WEIGHT / 9.81 / EDGE**3)
    laws = {name: replace(law, density=0.0) for name, law in hand_laws(mesh.region_names[1:]).items()}
    body = Body(mesh, {"block": stuff, **laws})

    def closed(way: float) -> Prescribed:
        left = prescribe(mesh, "left.held", x=way, y=0.0, z=0.0)
        return left + prescribe(mesh, "right.held", x=-way, y=0.0, z=0.0)

    pads = [
        Pair("left.skin", "block.x-", friction=friction, name="left"),
        Pair("right.skin", "block.x+", friction=friction, name="right"),
    ]
    return PrescribedTrials(body, closed, pads, "block")


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.3, 0.6, 0.9])
def test_each_presses_with_half_the_weight_over_friction(tip: Fingertip, friction: float) -> None:
    trials = tips_and_block(tip, friction)
    assert trials.weight.weight == pytest.approx(WEIGHT, rel=1e-6)
    found = gentlest_grip(trials, 3e-4, 4e-3, weight=WEIGHT, friction=friction, start=3e-4, tolerance=0.02)
    assert found.status is GripStatus.HELD
    needed = WEIGHT / (2.0 * friction)
    assert 0.5 * found.trial.force == pytest.approx(needed, rel=0.03)
    assert sum(trial.force > 0.0 for _, trial in found.trials) <= 5, found.ended
