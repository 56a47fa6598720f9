"""Wrong or hopeless input: messages that name what is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import FREE, lid, named, symmetric, together
from warpjld.errors import InputError
from warpjld.fem import (
    Body,
    LinearElastic,
    Loads,
    NeoHooke,
    SolveStatus,
    ball_hexes,
    box_hexes,
    cylinder_hexes,
    prescribe,
)
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.contact import Bond, ContactError, Exclusion, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane, Sphere
from warpjld.fem.contact.solver.damping import Damping
from warpjld.fem.contact.solver.lagged_solver import LaggedSolver


@pytest.fixture(scope="module")
def body() -> Body:
    return Body(ball_hexes(1.0, n=3, octant=True), LinearElastic(1.0, 0.3))


@pytest.mark.parametrize("friction", [float("nan"), -0.1, float("inf")])
def test_friction(friction: float) -> None:
    with pytest.raises(InputError, match="want a friction of 0 or more"):
        Pair("outer", lid(0.1), friction=friction, name="plate")


@pytest.mark.parametrize("strength", [0.0, -1.0, float("nan")])
def test_strength(strength: float) -> None:
    with pytest.raises(InputError, match="bond: want a shear strength above 0 Pa"):
        Bond(shear=strength)


@pytest.mark.parametrize("times", [(), (0.5, 0.5), (1.0, 0.5), (0.0, 1.0), (-1.0,), (float("nan"),), (float("inf"),)])
def test_times(body: Body, times: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match="want rising times above 0"):
        press(body, symmetric(body.mesh), [Pair("outer", lid(0.1))], times=times)


def test_no_pairs(body: Body) -> None:
    with pytest.raises(InputError, match="want at least one pair"):
        press(body, symmetric(body.mesh), [])


def test_faces_that_are_not_there(body: Body) -> None:
    held = symmetric(body.mesh)
    with pytest.raises(InputError, match=r"slave: no face set 'outr'; did you mean outer\?"):
        press(body, held, [Pair("outr", lid(0.1))])
    with pytest.raises(InputError, match="slave: no faces"):
        press(body, held, [Pair(np.empty((0, 2), np.int32), lid(0.1))])
    with pytest.raises(InputError, match="want faces of shape"):
        press(body, held, [Pair(np.arange(3, dtype=np.int32), lid(0.1))])
    with pytest.raises(InputError, match="faces must name an element"):
        press(body, held, [Pair(np.array([[99999, 0]], np.int32), lid(0.1))])
    with pytest.raises(InputError, match="master: no face set 'inside'"):
        press(body, held, [Pair("outer", "inside")])


@pytest.mark.parametrize("name", ["tolerance", "penetration"])
@pytest.mark.parametrize("value", [0.0, 1.0, -1e-3, float("nan")])
def test_tolerances(body: Body, name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name}: want a share between 0 and 1"):
        press(body, symmetric(body.mesh), [Pair("outer", lid(0.1))], **{name: value})  # type: ignore[arg-type]


def test_halvings(body: Body) -> None:
    with pytest.raises(InputError, match="halvings: want 0 or more, got -1"):
        press(body, symmetric(body.mesh), [Pair("outer", lid(0.1))], halvings=-1)
    with pytest.raises(InputError, match="solves: want 0 or more, got -1"):
        press(body, symmetric(body.mesh), [Pair("outer", lid(0.1))], solves=-1)


def test_labels() -> None:
    law = LinearElastic(1.0, 0.3)
    parts = {name: (named(box_hexes(counts=(2, 2, 1)), name, (0, 0, z)), law) for name, z in (("a", 0.0), ("b", 1.0))}
    body = together(parts)
    held = prescribe(body.mesh, "a.z-", x=0.0, y=0.0, z=0.0)
    four, never = np.zeros(4, np.int32), np.zeros((1, 1), bool)
    with pytest.raises(InputError, match="want one label for each of 4 slave and 4 master faces"):
        press(body, held, [Pair("a.z+", "b.z-", exclusion=Exclusion(four[:3], four, never))])
    with pytest.raises(InputError, match="labels must lie in 0…0"):
        press(body, held, [Pair("a.z+", "b.z-", exclusion=Exclusion(four + 1, four, never))])
    with pytest.raises(InputError, match="labels must lie in 0…0"):
        press(body, held, [Pair("a.z+", "b.z-", exclusion=Exclusion(four - 1, four, never))])
    with pytest.raises(InputError, match="never"):
        press(body, held, [Pair("a.z+", "b.z-", exclusion=Exclusion(four, four, np.zeros((1, 2), bool)))])


def test_going_on_from_something_else(body: Body) -> None:
    held, pair = symmetric(body.mesh), Pair("outer", lid(0.05))
    found = press(body, held, [pair])
    with pytest.raises(InputError, match="after: was found with 1 pairs, not 2"):
        press(body, held, [pair, pair], times=(2.0,), after=found)
    other = Body(ball_hexes(1.0, n=4, octant=True), LinearElastic(1.0, 0.3))
    with pytest.raises(InputError, match="after: is of a body with"):
        press(other, symmetric(other.mesh), [pair], times=(2.0,), after=found)
    with pytest.raises(InputError, match="want rising times above 1"):
        press(body, held, [pair], times=(1.0,), after=found)


@pytest.mark.parametrize(
    ("travel", "message"),
    [(0.99999, "no equilibrium found after time"), (1.05, "no equilibrium at time 1: .* both sides are prescribed")],
)
def test_a_body_squeezed_to_nothing_says_so(travel: float, message: str) -> None:
    """Two plates that close almost, or entirely: the last equilibrium, and why there is no other."""
    mesh = ball_hexes(1.0, n=2, octant=True)
    body = Body(mesh, NeoHooke(1.0, 0.3))
    with pytest.raises(ContactError, match=message) as caught:
        press(body, symmetric(mesh), [Pair("outer", lid(travel))], times=(0.2, 1.0), halvings=1)
    solution = caught.value.solution
    assert solution.status is not SolveStatus.CONVERGED
    assert solution.last.time == 0.2


def test_stops_as_asked(body: Body) -> None:
    pair = Pair("outer", lid(0.1))
    enough = lambda instant: "enough" if instant.touches[0].normal_force > 0.003 else None  # noqa: E731
    found = press(body, symmetric(body.mesh), [pair], times=np.arange(1, 11) / 10, watch=enough)
    assert found.status is SolveStatus.STOPPED
    assert found.message == "enough"
    assert [i.touches[0].normal_force > 0.003 for i in found.instants].index(True) == len(found.instants) - 1


def test_a_free_body_without_loads_stays(body: Body) -> None:
    found = press(body, FREE, [Pair("outer", lid(0.1, height=3.0))])
    assert np.abs(found.last.displacement).max() == 0.0


@pytest.mark.parametrize("young", [0.0, -1.0, float("nan"), float("inf")])
def test_a_stiffness_that_nothing_has(young: float) -> None:
    for law in (LinearElastic, NeoHooke):
        with pytest.raises(InputError, match="young: want a modulus above 0 Pa"):
            law(young, 0.3)


def test_a_bond_to_nothing() -> None:
    law = LinearElastic(1.0, 0.3)
    body = together({name: (named(box_hexes(), name, (0, 0, z)), law) for name, z in (("a", 0.0), ("b", 3.0))})
    held = prescribe(body.mesh, "a.z-", x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, "b.z+", x=0.0, y=0.0, z=0.0)
    with pytest.raises(InputError, match="a bond to nothing: its two sides do not meet"):
        press(body, held, [Pair("a.z+", "b.z-", bond=Bond())])


@pytest.mark.parametrize("beside", [0.3, 2.0], ids=["some of it", "all of it"])
def test_overlap_of_sides_that_are_both_prescribed(beside: float) -> None:
    """No force can part what may not move: named at once, without halving."""
    mesh = box_hexes((1.0, 1.0, 0.5), (4, 4, 2))
    above = np.flatnonzero((mesh.nodes[:, 2] == 0.5) & (mesh.nodes[:, 0] < beside))
    held = prescribe(mesh, "z-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, above, x=0.0, y=0.0, z=0.0)
    pair = Pair("z+", lid(0.1, height=0.5), name="lid")
    found = press(Body(mesh, NeoHooke(1.0, 0.3)), held, [pair], check=False)
    assert found.status is SolveStatus.BLOCKED
    assert "contact 'lid': both sides are prescribed and overlap by 100 mm" in found.message
    assert len(found.steps) == 0


def test_what_starts_inside_an_object_that_does_not_give_way() -> None:
    """A palm around a ball: a ring whose outside is held, and a ball in it that is larger than its hole. What there is
    to be parted is parted, or its overlap is named; a bone inside the ball is the second."""
    mesh = cylinder_hexes(1.0, 0.5, inner=0.5, n=8, layers=3, along=2)
    body = Body(mesh, NeoHooke(1.0, 0.45))
    outside = prescribe(mesh, "outer", x=0.0, y=0.0, z=0.0)
    parted = press(body, outside, [Pair("inner", Sphere((0, 0, 0.25), 0.6))], times=(1.0,))
    assert parted.last.touches[0].penetration < 1e-3 * 0.4
    assert parted.last.touches[0].normal_force > 0.0
    bone = outside + prescribe(mesh, "inner", x=0.0, y=0.0, z=0.0)
    found = press(body, bone, [Pair("inner", Sphere((0, 0, 0.25), 0.6))], check=False)
    assert found.status is SolveStatus.BLOCKED
    assert "both sides are prescribed" in found.message


def test_a_load_that_makes_a_block_give_way_is_named() -> None:
    """A cube on the ground under a pressure that does not turn with it sways at about π² E / 48 (Euler): below that it
    stands, above it there is no equilibrium to be found, and the last one is returned: the block leans over until its
    stiffness gives way, or its foot slides from under it."""
    mesh = box_hexes(counts=(3, 3, 3))
    pair = Pair("z-", Plane((0, 0, 0), (0, 0, 1)), friction=0.4)
    found = press(
        Body(mesh, NeoHooke(1.0, 0.3)),
        FREE,
        [pair],
        Loads(traction={"z+": (0.0, 0.0, -0.4)}),
        times=(0.4, 1.0),
        halvings=0,
        check=False,
    )
    assert found.status in {SolveStatus.INDEFINITE, SolveStatus.SLIDING}
    assert "unstable" in found.message or "slides" in found.message
    assert found.last.time == 0.4
    assert found.last.touches[0].force[2] == pytest.approx(0.16, rel=1e-3)


def test_a_stiffness_that_is_not_positive_definite_is_damped_for_a_step() -> None:
    """Stiffness at rest is lent until conjugate gradients have something to go down on; where even the largest share
    is not enough, it is said so. Whole steps give it back, short ones lend more."""
    mesh = box_hexes(counts=(4, 4, 4))
    body = Body(mesh, LinearElastic(1.0, 0.3))
    free = prescribe(mesh, "z-", x=0.0, y=0.0, z=0.0).free(body.degrees)
    right = np.where(free, 1.0, 0.0)
    rest = body.at().stiffness
    assert rest is not None
    for less, solvable in ((0.5, True), (1.1, True), (9.0, False)):
        given = BlockMatrix(rest.rows, rest.columns, (1.0 - less) * rest.values)
        solver, damping = LaggedSolver(body, "float64"), Damping(body)

        def attempt(given=given, solver=solver, damping=damping):
            return solver.solve(damping.lend(given), free, right)

        done = damping.until_definite(attempt)
        assert (done.status is SolveStatus.CONVERGED and done.x @ right > 0.0) == solvable
        assert (damping.share > max(0.0, less - 1.0)) == (less > 1.0)
    damping.begin()
    assert damping.lend(given) is given
    damping.judge(0.1)
    lent = damping.share
    assert lent > 0.0
    damping.judge(0.7)
    assert damping.share == lent
    while damping.share:
        before = damping.share
        damping.judge(1.0)
        assert damping.share < before


def test_a_guess_that_squeezes_elements_leads_to_the_same_equilibrium() -> None:
    """Its false pressures are not believed: those of the equilibrium before are."""
    mesh = ball_hexes(1.0, n=4, octant=True)
    body, held, pairs = Body(mesh, NeoHooke(1.0, 0.49)), symmetric(mesh), [Pair("outer", lid(0.1))]
    plain = press(body, held, pairs)
    noise = np.random.default_rng(2).uniform(-0.02, 0.02, mesh.nodes.shape)
    guessed = press(body, held, pairs, guess=lambda before, time, u: u + noise)
    assert len(guessed.steps) == 1
    np.testing.assert_allclose(guessed.last.displacement, plain.last.displacement, atol=2e-5)
