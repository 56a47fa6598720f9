"""The paper's loop: when it settles, and that it then agrees with the coupled method."""

import re
from dataclasses import replace

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import (
    Body,
    HexMesh,
    LinearElastic,
    NeoHooke,
    Prescribed,
    SolveStatus,
    box_hexes,
    finger_hexes,
    merge,
    prescribe,
)
from warpjld.fem.contact import ContactError, ContactSolution, Exclusion, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane


def _named(mesh: HexMesh, name: str, shift: tuple[float, float, float]) -> HexMesh:
    faces = {f"{name}.{key}": value for key, value in mesh.faces.items()}
    regions = np.zeros(len(mesh.elements), np.int32)
    return replace(mesh, nodes=mesh.nodes + np.array(shift), regions=regions, region_names=(name,), faces=faces)


def _blocks(master_over_slave: float) -> tuple[Body, Prescribed]:
    """A block pressed .1 of its height into a wider one under it; the upper is repelled by the lower."""
    lower = _named(box_hexes((1, 1, 1), counts=(3, 3, 3)), "lower", (0, 0, 0))
    upper = _named(box_hexes((0.8, 0.8, 1), counts=(3, 3, 3)), "upper", (0.1, 0.1, 1.0))
    mesh = merge(lower, upper)
    fixed = prescribe(mesh, "lower.z-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, "upper.z+", x=0.0, y=0.0, z=-0.1)
    return Body(mesh, {"lower": LinearElastic(master_over_slave, 0.3), "upper": LinearElastic(1.0, 0.3)}), fixed


def _press(ratio: float, **options: bool) -> ContactSolution:
    body, fixed = _blocks(ratio)
    return press(body, fixed, [Pair("upper.z-", "lower.z+")], method="paper", check=False, **options)


@pytest.mark.parametrize("ratio", [1.0, *(pytest.param(ratio, marks=pytest.mark.slow) for ratio in (0.1, 0.5))])
def test_it_never_settles_for_an_object_as_stiff_as_the_flesh(ratio):
    solution = _press(ratio)
    assert solution.status in (SolveStatus.MAX_ITERATIONS, SolveStatus.STAGNATED)
    assert "did not settle" in solution.message


@pytest.mark.parametrize(("ratio", "turns"), [(2.0, 15), (10.0, 6)])
def test_it_settles_where_the_skin_is_stiffer(ratio, turns):
    solution = _press(ratio)
    assert solution.converged
    assert solution.steps[0] // 2 <= turns


@pytest.mark.parametrize(
    ("ratio", "agreement"),
    [(0.1, 0.05), (10.0, 0.02), *(pytest.param(ratio, 0.02, marks=pytest.mark.slow) for ratio in (0.5, 1.0, 2.0))],
)
def test_relaxed_after_aitken_it_settles_and_agrees_with_the_coupled_method(ratio, agreement):
    body, fixed = _blocks(ratio)
    # repelled nodes stick
    together = press(body, fixed, [Pair("upper.z-", "lower.z+", friction=1e3)]).last.touches[0]
    by_turns = _press(ratio, aitken=True)
    assert by_turns.converged
    assert by_turns.last.touches[0].force[2] == pytest.approx(together.force[2], rel=agreement)
    # action equals reaction
    assert np.abs(by_turns.last.touches[0].nodal.sum(axis=0)).max() < 1e-12


def _fingertip(plate_over_flesh: float | None) -> tuple[Body, Prescribed]:
    """A finger along x whose bone comes down by a millimetre, on a plate that deforms as well, or on nothing."""
    mesh = finger_hexes(0.008, 0.03, n=4, along=8)
    tip = replace(
        mesh, nodes=mesh.nodes[:, [2, 0, 1]], faces={f"finger.{key}": value for key, value in mesh.faces.items()}
    )
    young = 6e4
    laws = {"bone": NeoHooke(100 * young, 0.3), "flesh": NeoHooke(young, 0.45)}
    bone = np.unique(tip.elements[tip.region("bone")])
    if plate_over_flesh is None:
        return Body(tip, laws), prescribe(tip, bone, x=0.0, y=0.0, z=-1e-3)
    low = float(tip.nodes[:, 2].min()) - 5e-5
    plate = _named(box_hexes((0.03, 0.03, 0.008), (10, 10, 3), origin=(0.008, -0.015, low - 0.008)), "plate", (0, 0, 0))
    whole = merge(tip, plate)
    body = Body(whole, {**laws, "plate": NeoHooke(plate_over_flesh * young, 0.45)})
    bone = np.unique(whole.elements[whole.region("bone")])
    held = prescribe(whole, bone, x=0.0, y=0.0, z=-1e-3)
    return body, held + prescribe(whole, "plate.z-", x=0.0, y=0.0, z=0.0)


@pytest.mark.parametrize("ratio", [0.5, pytest.param(2.0, marks=pytest.mark.slow)])
def test_a_finger_on_a_plate_settles(ratio):
    """Forces are those of the coupled method as far as nodes on facets are like mortar averages, at 3 mm an edge."""
    body, held = _fingertip(ratio)
    by_turns = press(body, held, [Pair("plate.z+", "finger.skin")], times=(0.5, 1.0), method="paper", aitken=True)
    assert max(by_turns.steps) // 2 <= 10
    together = press(body, held, [Pair("plate.z+", "finger.skin", friction=5.0)], times=(0.5, 1.0))
    assert by_turns.last.touches[0].force[2] == pytest.approx(together.last.touches[0].force[2], rel=0.1)


def test_a_finger_on_an_obstacle_settles_without_relaxation():
    """An obstacle does not give way: what repelling finds holds."""
    body, held = _fingertip(None)
    low = float(body.mesh.nodes[body.mesh.node_set("finger.skin"), 2].min())
    pair = Pair("finger.skin", Plane((0, 0, low - 1e-4), (0, 0, 1)))
    times = np.arange(1, 9) / 8  # nodes stick where they first touch
    by_turns = press(body, held, [pair], times=times, method="paper")
    assert max(by_turns.steps) // 2 <= 5
    together = press(body, held, [replace(pair, friction=5.0)], times=times)
    assert by_turns.last.touches[0].force[2] == pytest.approx(together.last.touches[0].force[2], rel=0.03)


def test_it_goes_on_from_a_solution():
    """To the same forces; where nodes stick on the way depends on the turns."""
    body, fixed = _blocks(2.0)
    pairs = [Pair("upper.z-", "lower.z+")]
    options = {"method": "paper", "aitken": True, "penetration": 1e-5}
    known = lambda time: fixed.scaled(time)  # noqa: E731
    once = press(body, known, pairs, times=(0.5, 1.0), **options)
    first = press(body, known, pairs, times=(0.5,), **options)
    then = press(body, known, pairs, times=(1.0,), after=first, **options)
    np.testing.assert_allclose(then.last.touches[0].force, once.last.touches[0].force, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(then.last.displacement, once.last.displacement, atol=5e-4)


def test_deep_overlaps_are_taken_in_shorter_steps():
    """A tenth of the height is a third of an edge; nothing that was not asked for is reported."""
    body, fixed = _blocks(2.0)
    found = press(body, fixed, [Pair("upper.z-", "lower.z+")], method="paper", aitken=True)
    assert len(found.steps) > len(found.instants) == 1


def test_how_it_failed_is_told():
    found = _press(0.1)
    assert re.search(r"did not settle in \d+ turns: each turn moves [\d.]+ times as far", found.message)
    assert "use Aitken relaxation" in found.message
    body, fixed = _blocks(0.1)
    with pytest.raises(ContactError, match="did not settle"):
        press(body, fixed, [Pair("upper.z-", "lower.z+")], method="paper")


def test_what_it_cannot_do_is_refused():
    body, fixed = _blocks(1.0)
    with pytest.raises(InputError, match="neither friction nor bonds"):
        press(body, fixed, [Pair("upper.z-", "lower.z+", friction=0.5)], method="paper")
    faces, never = np.zeros(9, np.int32), np.zeros((1, 1), bool)
    with pytest.raises(InputError, match="supports no self-contact"):
        press(body, fixed, [Pair("upper.z-", "lower.z+", exclusion=Exclusion(faces, faces, never))], method="paper")
    with pytest.raises(InputError, match="want augmented or paper"):
        press(body, fixed, [Pair("upper.z-", "lower.z+")], method="papers")
