"""Bodies do not pass through each other: long steps are cut, deep overlaps parted, and what is left is named."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.fem import LinearElastic, Loads, NeoHooke, Prescribed, SolveStatus, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Box

RUBBER = LinearElastic(1e6, 0.3)
SAME = 0.02
"""Forces on finer meshes beside those on coarse ones: the clamped ends differ by about a hundredth."""


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


@pytest.mark.parametrize("overlap", [0.3, 0.6])
@pytest.mark.parametrize(("low", "up", "swapped"), [(4, 4, False), (8, 8, False), (8, 4, True), (4, 8, True)])
def test_deep_overlap_at_the_start_is_parted_however_fine_the_mesh(
    overlap: float, low: int, up: int, swapped: bool
) -> None:
    """The force is that of the same blocks brought there from apart, for Hooke's law whichever way."""
    expected = one(pressed(3, 3, overlap, 0.0, times=np.linspace(0.1, 1.0, 10)))
    found = pressed(low, up, 0.0, -overlap, swapped=swapped)
    assert one(found) == pytest.approx(expected, rel=SAME)
    assert found.last.touches[0].penetration < 2e-3


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
