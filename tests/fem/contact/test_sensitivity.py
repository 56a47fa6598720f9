"""Derivatives of contact equilibria against differences of equilibria that are solved again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fem.contact.bodies import named, together
from warpjld.errors import InputError
from warpjld.fem import Body, NeoHooke, Prescribed, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane, Sphere
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, Response, SensitivityError
from warpjld.fem.contact.sensitivity.perturbation import ObstacleTwist, Perturbation

EXACT = 1e-3


@dataclass(frozen=True)
class Case:
    """A problem of two load steps: the second, from the same first, is what is differentiated.

    Attributes:
        down, aside: Way of the upper side in both steps [m].
        friction: μ.
        young: Of the softer body.
        turned: By how much the obstacle turns about z in the second step [rad].
    """

    down: tuple[float, float] = (0.08, 0.081)
    aside: tuple[float, float] = (0.0, 0.02)
    friction: float = 0.0
    young: float = 1.0
    turned: float = 0.0


class Dented:
    """A soft block under a ball, or under a flat plate where ``flat``."""

    def __init__(self, flat: bool) -> None:
        self.flat = flat
        self.mesh = named(box_hexes((1.0, 1.0, 0.5), (4, 4, 2)), "block", (-0.5, -0.5, -0.5))

    def body(self, case: Case) -> Body:
        return Body(self.mesh, NeoHooke(case.young, 0.4))

    def pair(self, case: Case) -> Pair:
        def motion(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            down, aside = (np.interp(time, [0, 1, 2], [0.0, *way]) for way in (case.down, case.aside))
            turn = case.turned * max(time - 1.0, 0.0)
            return np.array([aside, 0.03, 0.03 - down]), np.array([0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)])

        if self.flat:
            return Pair("block.z+", Plane((0, 0, 0), (0.1, 0.05, -1.0), motion=motion), friction=case.friction)
        return Pair("block.z+", Sphere((0, 0, 0.9), 0.9, motion=motion), friction=case.friction)

    def known(self, case: Case, time: float) -> Prescribed:
        return prescribe(self.mesh, "block.z-", x=0.0, y=0.0, z=0.0)


class Stacked:
    """A soft block on another, of different meshes."""

    def __init__(self) -> None:
        low = named(box_hexes((1.0, 1.0, 0.4), (4, 4, 2)), "a", (-0.5, -0.5, -0.4))
        high = named(box_hexes((0.6, 0.6, 0.4), (3, 3, 2)), "b", (-0.32, -0.27, 0.0))
        top = high.nodes.copy()
        top[:, 2] += 0.15 * ((top[:, 0] + 0.02) ** 2 + (top[:, 1] - 0.03) ** 2)
        self.low, self.high = low, replace(high, nodes=top)

    def body(self, case: Case) -> Body:
        return together({"a": (self.low, NeoHooke(case.young, 0.3)), "b": (self.high, NeoHooke(3.0, 0.3))})

    def pair(self, case: Case) -> Pair:
        return Pair("b.z-", "a.z+", friction=case.friction)

    def known(self, case: Case, time: float) -> Prescribed:
        mesh = self.body(case).mesh
        down, aside = (np.interp(time, [0, 1, 2], [0.0, *way]) for way in (case.down, case.aside))
        return prescribe(mesh, "a.z-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, "b.z+", x=aside, y=0.0, z=-down)


Problem = Dented | Stacked


def solved(problem: Problem, case: Case, before: ContactSolution | None = None) -> ContactSolution:
    """The first step, or the second after it."""
    times = (1.0,) if before is None else (2.0,)
    return press(
        problem.body(case),
        lambda time: problem.known(case, time),
        [problem.pair(case)],
        times=times,
        after=before,
        tolerance=1e-10,
        penetration=1e-7,
    )


def tangent_of(problem: Problem, case: Case, found: ContactSolution) -> EquilibriumTangent:
    known = problem.known(case, 2.0).degrees
    return EquilibriumTangent(problem.body(case), [problem.pair(case)], found, known)


def aside(problem: Problem, case: Case, by: float) -> tuple[Case, Perturbation]:
    return replace(case, aside=(case.aside[0], case.aside[1] + by)), moved(problem, (1.0, 0.0, 0.0))


def down(problem: Problem, case: Case, by: float) -> tuple[Case, Perturbation]:
    return replace(case, down=(case.down[0], case.down[1] + by)), moved(problem, (0.0, 0.0, -1.0))


def turned(problem: Problem, case: Case, by: float) -> tuple[Case, Perturbation]:
    middle = np.asarray(problem.pair(case).master.motion(2.0)[0])  # type: ignore[union-attr]
    twist = ObstacleTwist(np.zeros(3), np.array([0.0, 0.0, 1.0]), middle)
    return replace(case, turned=case.turned + by), Perturbation(obstacles={0: twist})


def stiffer(problem: Problem, case: Case, by: float) -> tuple[Case, Perturbation]:
    mesh = problem.body(case).mesh
    return replace(case, young=case.young + by), Perturbation(stiffness=(mesh.regions == 0) / case.young)


def rougher(problem: Problem, case: Case, by: float) -> tuple[Case, Perturbation]:
    return replace(case, friction=case.friction + by), Perturbation(friction={0: 1.0})


def moved(problem: Problem, way: tuple[float, float, float]) -> Perturbation:
    """The ball or plate, or the upper block's top."""
    if isinstance(problem, Dented):
        return Perturbation(obstacles={0: ObstacleTwist(np.array(way))})
    mesh = problem.body(Case()).mesh
    prescribed = np.zeros_like(mesh.nodes)
    prescribed[mesh.node_set("b.z+")] = way
    return Perturbation(prescribed=prescribed.ravel())


Change = Callable[[Problem, Case, float], tuple[Case, Perturbation]]
BALL, PLATE, BLOCKS = Dented(False), Dented(True), Stacked()


@pytest.mark.parametrize(
    ("problem", "case", "stuck", "sliding", "changes"),
    [
        (BALL, Case(), 0, 0, (aside, down, stiffer)),
        (BALL, Case(friction=2.0), 5, 0, (aside, down, turned)),
        (PLATE, Case(friction=0.15), 5, 18, (aside, down, stiffer, rougher)),
        (BLOCKS, Case(), 0, 0, (down,)),
        (BLOCKS, Case(friction=2.0), 16, 0, (aside, stiffer)),
        (BLOCKS, Case(friction=0.15), 5, 11, (aside, down, stiffer, rougher)),
    ],
    ids=["ball", "ball stuck", "plate sliding", "blocks", "blocks stuck", "blocks sliding"],
)
def test_against_equilibria_solved_again(
    problem: Problem, case: Case, stuck: int, sliding: int, changes: tuple[Change, ...]
) -> None:
    before = solved(problem, case)
    found = solved(problem, case, before)
    tangent = tangent_of(problem, case, found)
    (slopes,) = tangent.interfaces
    assert (slopes.sticks.sum(), slopes.slides.sum()) == pytest.approx((stuck, sliding), abs=2)
    for change in changes:
        response = tangent.response(change(problem, case, 0.0)[1])
        step = 1e-5
        ahead, behind = (solved(problem, change(problem, case, s * step)[0], before) for s in (1.0, -1.0))
        assert all(np.array_equal(end.states[0].sticking, found.states[0].sticking) for end in (ahead, behind))
        for name, wanted in _values(ahead).items():
            difference = (wanted - _values(behind)[name]) / (2.0 * step)
            got = _derivatives(response)[name]
            if name != "displacement" or np.abs(difference).max() > 1e-6:
                np.testing.assert_allclose(got, difference, rtol=0, atol=EXACT * np.abs(difference).max(), err_msg=name)


def _values(found: ContactSolution) -> dict[str, NDArray[np.float64]]:
    last = found.last
    return {"displacement": last.displacement, "reactions": last.reactions, "contact": last.touches[0].nodal}


def _derivatives(response: Response) -> dict[str, NDArray[np.float64]]:
    return {"displacement": response.displacement, "reactions": response.reactions, "contact": response.nodal[0]}


def test_forces_balance_as_they_change() -> None:
    case = Case(friction=0.15)
    found = solved(BLOCKS, case, solved(BLOCKS, case))
    tangent = tangent_of(BLOCKS, case, found)
    response = tangent.response(down(BLOCKS, case, 0.0)[1])
    np.testing.assert_allclose(response.nodal[0].sum(axis=0), 0.0, atol=1e-9 * np.abs(response.nodal).max())
    np.testing.assert_allclose(response.reactions.sum(axis=0), 0.0, atol=1e-7 * np.abs(response.reactions).max())


def test_what_cannot_be_is_refused() -> None:
    case = Case()
    found = solved(BLOCKS, case)
    with pytest.raises(InputError, match="read from a state"):
        tangent_of(BLOCKS, case, replace(found, last_step=None))
    with pytest.raises(InputError, match="of this body"):
        tangent_of(PLATE, case, found)
    with pytest.raises(InputError, match="pair 0 has no obstacle"):
        tangent_of(BLOCKS, case, found).response(Perturbation(obstacles={0: ObstacleTwist(np.ones(3))}))


def test_what_is_free_to_move_has_no_derivative() -> None:
    """Nothing but a plate without friction touches the block: it may slide along."""
    case = Case()
    found = solved(PLATE, case)
    with pytest.raises(SensitivityError, match="a body is free to move"):
        EquilibriumTangent(PLATE.body(case), [PLATE.pair(case)], found, np.empty(0, np.int64))
