"""Wrong or hopeless input: messages that name what is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import FREE, lid, named, symmetric, together
from warpjld.errors import InputError
from warpjld.fem import Body, LinearElastic, NeoHooke, Status, ball, box, prescribe
from warpjld.fem.contact import Bond, ContactError, Exclusion, Pair, press


@pytest.fixture(scope="module")
def body() -> Body:
    return Body(ball(1.0, n=3, octant=True), LinearElastic(1.0, 0.3))


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


def test_labels() -> None:
    law = LinearElastic(1.0, 0.3)
    parts = {name: (named(box(counts=(2, 2, 1)), name, (0, 0, z)), law) for name, z in (("a", 0.0), ("b", 1.0))}
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
    other = Body(ball(1.0, n=4, octant=True), LinearElastic(1.0, 0.3))
    with pytest.raises(InputError, match="after: is of a body with"):
        press(other, symmetric(other.mesh), [pair], times=(2.0,), after=found)
    with pytest.raises(InputError, match="want rising times above 1"):
        press(body, held, [pair], times=(1.0,), after=found)


def test_a_body_squeezed_to_nothing_says_so() -> None:
    """Two plates that close entirely: the last equilibrium, and why there is no other."""
    mesh = ball(1.0, n=3, octant=True)
    with pytest.raises(ContactError, match="no equilibrium found after time") as caught:
        press(Body(mesh, NeoHooke(1.0, 0.3)), symmetric(mesh), [Pair("outer", lid(1.05))], times=(0.2, 1.0))
    solution = caught.value.solution
    assert solution.status is not Status.CONVERGED
    assert solution.last.time == 0.2


def test_stops_as_asked(body: Body) -> None:
    pair = Pair("outer", lid(0.1))
    enough = lambda instant: "enough" if instant.touches[0].normal_force > 0.003 else None  # noqa: E731
    found = press(body, symmetric(body.mesh), [pair], times=np.arange(1, 11) / 10, watch=enough)
    assert found.status is Status.STOPPED
    assert found.message == "enough"
    assert [i.touches[0].normal_force > 0.003 for i in found.instants].index(True) == len(found.instants) - 1


def test_a_free_body_without_loads_stays(body: Body) -> None:
    found = press(body, FREE, [Pair("outer", lid(0.1, height=3.0))])
    assert np.abs(found.last.displacement).max() == 0.0
