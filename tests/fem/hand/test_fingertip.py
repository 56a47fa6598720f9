"""A fingertip by itself, and what it does on a plate."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Body, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.hand import hand_laws
from warpjld.fem.hand.fingertip import Fingertip, build_fingertip
from warpjld.hand.kept import kept_hand


@pytest.fixture(scope="module")
def tip() -> Fingertip:
    return build_fingertip(kept_hand("left", resolution=4000), "index", 0.0018)


def test_bone_nail_and_pulp(tip: Fingertip) -> None:
    assert tip.fit.least > 0.1
    assert 0.022 < tip.length < 0.027
    assert 0.004 < tip.thickness < 0.008
    for region in tip.mesh.region_names:
        assert tip.mesh.region(region).any()
    # what is held lies on the nail's side, but for the cut; what is pressed does not
    held = tip.mesh.nodes[tip.mesh.node_sets["held"]] - tip.joint
    beyond = held[held @ tip.along > 0.1 * tip.length]
    assert (beyond @ tip.back > -0.002).all()
    assert tip.facing(0.0) == pytest.approx(-tip.back)
    assert tip.facing(np.pi / 2) == pytest.approx(tip.along)
    with pytest.raises(InputError, match="no joint 'finger"):
        build_fingertip(kept_hand("left", resolution=2500), "finger")


def test_pressed_fingertip_stiffens(tip: Fingertip) -> None:
    out = tip.facing(0.4)
    first = tip.mesh.nodes[int(np.argmax(tip.mesh.nodes @ out))]
    plate = Plane(first, -out, motion=lambda way: (-way * out, (0.0, 0.0, 0.0, 1.0)))
    found = press(
        Body(tip.mesh, hand_laws(tip.mesh.region_names)),
        prescribe(tip.mesh, "held", x=0.0, y=0.0, z=0.0),
        [Pair("tip", plate, name="plate")],
        times=[0.5e-3, 1.0e-3, 1.5e-3],
    )
    force = np.array([i.touches[0].normal_force for i in found.instants])
    area = np.array([i.touches[0].contact_area for i in found.instants])
    assert (np.diff(area) > 0.0).all()
    assert force[1] > 2.5 * force[0]  # faster than Hertz's 2^1.5 at the least
    assert force[2] - force[1] > 2.0 * (force[1] - force[0])
    assert 0.4 < force[2] < 2.0
    np.testing.assert_allclose(found.last.reactions.sum(axis=0), force[2] * out, atol=2e-3 * force[2])


@pytest.mark.slow
def test_example_presses_as_people_do(tmp_path: Path) -> None:
    example = Path(__file__).resolve().parents[3] / "examples" / "fingertip.py"
    found = runpy.run_path(str(example))["main"](tmp_path, 0.0012, np.radians(25.0))
    assert 1.5e-3 <= found["displacement_at_1N"] <= 2.0e-3
    assert found["stiffness_1N_to_5N"] >= 3.5e3
    assert 3e-5 < found["area_at_1N"] < found["area_at_5N"] < 2e-4
    assert {p.name for p in tmp_path.iterdir()} == {"fingertip.csv", "fingertip.png", "force_and_area.png"}
