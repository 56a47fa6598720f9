"""Bodies do not pass through each other: long steps are cut, deep overlaps parted, and what is left is named."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.fem import Body, LinearElastic, Loads, NeoHooke, Prescribed, SolveStatus, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.interface.contact_interface import interfaces_of
from warpjld.fem.contact.interface.own_elements import inside_own
from warpjld.fem.contact.obstacles.solids import Box
from warpjld.fem.contact.solver.passing import Passing

RUBBER = LinearElastic(1e6, 0.3)
SAME = 0.02
"""Forces on finer meshes beside those on coarse ones: the clamped ends differ by about a hundredth."""
_QUICK = ((4, 4, False, 0.3), (8, 8, False, 0.6), (8, 4, True, 0.6), (4, 8, True, 0.6))
"""Meshes and overlaps that are not slow: the deep ones of every pair that does not match."""


def pressed(
    low: int, up: int, travel: float, gap: float, *, swapped: bool = False, large: bool = False, **options: object
) -> ContactSolution:
    """Two unit blocks of so many elements a side, the upper one's top brought down; ``swapped`` slave and master."""
    law = NeoHooke(1e6, 0.3) if large else RUBBER
    lower = named(box_hexes((1, 1, 1), (low,) * 3), "low")
    upper = named(box_hexes((1, 1, 1), (up,) * 3), "up", (0, 0, 1 + gap))
    body = together({"low": (lower, law), "up": (upper, law)})
    held = prescribe(body.mesh, "low.z-", x=0, y=0, z=0) + prescribe(body.mesh, "up.z+", x=0, y=0, z=-travel)
    sides = ("low.z+", "up.z-") if swapped else ("up.z-", "low.z+")
    return press(body, held, [Pair(*sides, name="blocks")], check=False, **options)  # type: ignore[arg-type]


def one(found: ContactSolution) -> float:
    assert found.status is SolveStatus.CONVERGED, found.message
    return found.last.touches[0].normal_force


def test_a_step_longer_than_contact_looks_ahead_is_cut() -> None:
    """Half a block in one step, three of its elements: steps once ended behind the surface without a force."""
    found = pressed(6, 6, 0.5, 0.01)
    assert one(found) == pytest.approx(one(pressed(3, 3, 0.49, 0.0)), rel=SAME)
    assert len(found.steps) > 1


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, 12])
def test_large_strain_and_finer_meshes_alike(count: int) -> None:
    coarse = one(pressed(4, 4, 0.5, 0.1, large=True))
    assert one(pressed(count, count, 0.5, 0.1, large=True)) == pytest.approx(coarse, rel=SAME)


@pytest.mark.parametrize(
    ("low", "up", "swapped", "overlap"),
    [
        pytest.param(*sides, overlap, marks=[] if (*sides, overlap) in _QUICK else pytest.mark.slow)
        for sides in ((4, 4, False), (8, 8, False), (8, 4, True), (4, 8, True))
        for overlap in (0.3, 0.6)
    ],
)
def test_deep_overlap_at_the_start_is_parted_however_fine_the_mesh(
    low: int, up: int, swapped: bool, overlap: float
) -> None:
    """The force is that of the same blocks brought there from apart, for Hooke's law whichever way."""
    found = pressed(low, up, 0.0, -overlap, swapped=swapped)
    assert one(found) == pytest.approx(_from_apart(overlap), rel=SAME)
    assert found.last.touches[0].penetration < 2e-3


@cache
def _from_apart(overlap: float) -> float:
    return one(pressed(3, 3, overlap, 0.0, times=np.linspace(0.1, 1.0, 10)))


def test_overlap_that_the_pair_s_faces_do_not_see_is_named() -> None:
    """A block beside another, moved sideways into it: the pair knows of top and bottom only."""
    lower = named(box_hexes((1, 1, 1), (4, 4, 4)), "low")
    upper = named(box_hexes((1, 1, 1), (4, 4, 4)), "up", (1.1, 0, 0.4))
    body = together({"low": (lower, RUBBER), "up": (upper, RUBBER)})
    held = prescribe(body.mesh, "low.z-", x=0, y=0, z=0) + prescribe(body.mesh, "up.z+", x=-0.8, y=0, z=0)
    found = press(body, held, [Pair("up.z-", "low.z+", name="blocks")], check=False)
    assert found.status is SolveStatus.PASSED
    assert "contact 'blocks'" in found.message


def test_a_block_thrown_through_another_in_one_step_meets_it() -> None:
    """Both ends of the step are apart: a thin block goes by ten times its own thickness."""
    lower = named(box_hexes((1, 1, 0.3), (4, 4, 2)), "low")
    upper = named(box_hexes((1, 1, 0.3), (4, 4, 2)), "up", (0, 0, 0.5))
    body = together({"low": (lower, RUBBER), "up": (upper, RUBBER)})
    low = prescribe(body.mesh, "low.z-", x=0, y=0, z=0)

    def known(time: float) -> Prescribed:
        return low + prescribe(body.mesh, "up.z+", x=0, y=0, z=-2.0 * time)

    found = press(body, known, [Pair("up.z-", "low.z+", name="blocks")], times=(1.0,), check=False)
    assert found.status is not SolveStatus.CONVERGED or found.last.touches[0].normal_force > 0.0


def test_a_thin_obstacle_is_not_jumped_over() -> None:
    """The whole lower face goes through a plate in one step."""
    block = together({"up": (named(box_hexes((0.1, 0.1, 0.1), (4, 4, 4)), "up", (0, 0, 0.02)), RUBBER)})
    plate = Box((0.3, 0.3, 0.004), (0.05, 0.05, 0.0))
    held = prescribe(block.mesh, "up.z+", x=0, y=0, z=-0.05)
    found = press(block, held, [Pair("up.z-", plate)], check=False)
    expected = press(block, held, [Pair("up.z-", plate)], times=np.linspace(0.05, 1.0, 20)).last
    assert found.status is SolveStatus.CONVERGED
    assert found.last.touches[0].normal_force == pytest.approx(expected.touches[0].normal_force, rel=1e-3)


def test_bodies_that_go_along_together_are_not_slowed_down() -> None:
    """Ten lengths in one step, both alike: nothing is cut, and their pressure stays."""
    lower = named(box_hexes((1, 1, 1), (3, 3, 3)), "low")
    upper = named(box_hexes((1, 1, 1), (3, 3, 3)), "up", (0, 0, 0.95))
    body = together({"low": (lower, RUBBER), "up": (upper, RUBBER)})
    held = prescribe(body.mesh, "low.z-", x=10, y=0, z=0) + prescribe(body.mesh, "up.z+", x=10, y=0, z=0)
    found = press(body, held, [Pair("up.z-", "low.z+")], loads=Loads(), check=False)
    assert found.status is SolveStatus.CONVERGED
    assert len(found.steps) == 1


@pytest.mark.parametrize(("depth", "status"), [(0.005, SolveStatus.CONVERGED), (0.1, SolveStatus.BLOCKED)])
def test_sides_that_are_both_prescribed_may_graze(depth: float, status: SolveStatus) -> None:
    """As bones and a plate do that come 15 micrometres too near: an overlap of less than a fiftieth of an edge is no
    reason to give up, more cannot be parted."""
    lower = named(box_hexes((1, 1, 1), (2, 2, 2)), "low")
    upper = named(box_hexes((1, 1, 1), (2, 2, 2)), "up", (0, 0, 1 - 0.5 * depth))
    body = together({"low": (lower, RUBBER), "up": (upper, RUBBER)})
    held = prescribe(body.mesh, "low.z+", x=0, y=0, z=0) + prescribe(body.mesh, "up.z-", x=0, y=0, z=0)
    pair = Pair("up.z-", "low.z+", name="blocks")
    found = press(body, held, [pair], Loads(traction={"up.z+": (0.0, 0.0, -10.0)}), check=False)
    assert found.status is status, found.message
    if status is SolveStatus.CONVERGED:
        assert found.last.touches[0].normal_force == 0.0


def test_ends_of_a_ring_are_seen_to_pass_through_each_other() -> None:
    """A ring with a gap of 40°, one body with itself, whose ends go past each other, or stop before they meet."""
    mesh = box_hexes((1.0, 0.004, 0.01), (16, 2, 2))
    along, out, across = (mesh.nodes - mesh.nodes.min(axis=0)).T
    angle, radius = np.radians(20.0 + 320.0 * along), 0.02 + out
    mesh = replace(mesh, nodes=np.stack([radius * np.cos(angle), radius * np.sin(angle), -across], axis=1))
    passing = Passing(Body(mesh, NeoHooke(1e6, 0.3)), interfaces_of(mesh, [Pair("x-", "x+", name="ends")], 1))
    past = np.zeros((len(along), 3))
    past[:, 1] = 0.02 * np.sign(along - 0.5) * abs(2.0 * along - 1.0) ** 3  # ends lie at ∓.007 m
    assert passing.went_through(np.zeros(past.size), past.ravel(), 0.0, 1.0)
    assert not passing.went_through(np.zeros(past.size), 0.3 * past.ravel(), 0.0, 1.0)


def test_nodes_in_elements_of_their_own_body() -> None:
    """A row of elements of which the last is folded back over the first by a fifth."""
    mesh = box_hexes((4.0, 1.0, 1.0), (4, 1, 1))
    x = mesh.nodes.copy()
    moved = x[:, 0] > 2.5
    x[moved] -= [2.8, 0.3, 0.2]
    found = inside_own(x, mesh.elements, np.arange(len(x)))
    inside = {tuple(place) for place in x[found].round(6)}
    assert {(0.2, 0.7, 0.8), (1.2, 0.7, 0.8), (1.0, 0.0, 0.0)} == inside
