"""A free object that gives way through a medium: a spring pulls a node to where no single step gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.fem import Loads, SolveStatus
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.solve import branch
from warpjld.simulation.solve.eased import around_free_objects, solve_eased

SPRING = 500.0
"""Stiffness that draws the node [N/m]."""
AROUND = np.array([1.0])


def solution(time: float, at: float, status: SolveStatus = SolveStatus.CONVERGED, solves: int = 3) -> ContactSolution:
    force = SPRING * np.array([[at, 0.0, 0.0]])
    touch: Any = SimpleNamespace(nodal=np.where(np.abs(force) > 0.0, 1.0, 0.0))  # what presses, about 1 N
    displacement = np.array([[at, 0.0, 0.0]])
    instant = ContactInstant(time, displacement, np.zeros((1, 3)), (touch,), solves, 0, 0.0)
    return ContactSolution(status, (instant,), "", (), (solves,), Loads(), spent=solves)


def spring(goal: float, longest: float, solved: list[float]) -> Callable[..., ContactSolution]:
    """Steps of a node drawn to ``goal``, which fail where it would go farther in one than ``longest``."""

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        at, since = (0.0, 0.0) if before is None else (float(before.last.displacement[0, 0]), before.last.time)
        around = loads(time).drag
        resists = 0.0 if around is None else float(around[0]) / (time - since)
        to = (SPRING * goal + resists * at) / (SPRING + resists)
        if abs(to - at) > longest:
            return solution(since, at, SolveStatus.INDEFINITE, 20)
        solved.append(time)
        return solution(time, to)

    return step


@pytest.mark.parametrize("longest", [4e-3, 2e-3, 8e-4])
def test_what_a_step_does_not_find_is_reached_through_a_medium(longest: float) -> None:
    goal, start, times = 5e-3, solution(2.0, 0.0), list[float]()
    step = spring(goal, longest, times)
    assert not step(start, 3.0, lambda time: Loads(), True).converged
    found = solve_eased(step, lambda time: Loads(), start, 3.0, AROUND)
    assert found.converged
    assert found.last.time == 3.0
    assert found.last.displacement[0, 0] == pytest.approx(goal, rel=1e-9)  # the last step has no medium
    assert times == sorted(times)
    assert found.spent >= 3 * len(times)


def test_it_begins_from_rest_too() -> None:
    found = solve_eased(spring(5e-3, 4e-3, []), lambda time: Loads(), None, 3.0, AROUND)
    assert found.converged
    assert found.last.displacement[0, 0] == pytest.approx(5e-3, rel=1e-9)


def test_what_fails_without_a_medium_rests_in_one_that_bears_nothing() -> None:
    """As what rolls freely, which the stiffness alone does not hold."""
    goal, usual = 5e-3, spring(5e-3, 4e-3, [])
    without = []

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        if loads(time).drag is None:
            without.append(time)
            return solution(2.0, 0.0, SolveStatus.SLIDING, 20)
        return usual(before, time, loads, exact)

    found = solve_eased(step, lambda time: Loads(), solution(2.0, 0.0), 3.0, AROUND)
    assert found.converged
    assert (found.last.time, without) == (3.0, [3.0])
    assert SPRING * abs(found.last.displacement[0, 0] - goal) <= 1e-4  # of about 1 N that presses


def test_what_drifts_on_is_not_found() -> None:
    """A force that nothing opposes moves it on at the same speed."""

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        assert before is not None
        around = loads(time).drag
        if around is None:
            return solution(2.0, 0.0, SolveStatus.INDEFINITE, 20)
        resists = float(around[0]) / (time - before.last.time)
        return solution(time, float(before.last.displacement[0, 0]) + 1.0 / resists)

    found = solve_eased(step, lambda time: Loads(), solution(2.0, 0.0), 3.0, AROUND)
    assert not found.converged
    assert found.spent <= 220


def test_what_one_digit_pushes_away_rests_once_it_is_hardly_touched() -> None:
    """Its drift becomes slower and slower, and all that presses is what the medium resists with."""
    taken = []

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        assert before is not None
        taken.append(time)
        at, around = float(before.last.displacement[0, 0]), loads(time).drag
        resists = 0.0 if around is None else float(around[0]) / (time - before.last.time)
        to = (SPRING * 1e-3 + resists * at) / (SPRING + resists)
        found = solution(time, to)
        touch: Any = SimpleNamespace(nodal=np.array([[SPRING * (1e-3 - to), 0.0, 0.0]]))
        return replace(found, instants=(replace(found.last, touches=(touch,)),))

    found = solve_eased(step, lambda time: Loads(), solution(2.0, 0.0), 3.0, AROUND)
    assert found.converged
    assert len(taken) <= 15


def test_steps_that_all_fail_end_it() -> None:
    tried = []

    def step(
        before: ContactSolution | None, time: float, loads: Callable[[float], Loads], exact: bool
    ) -> ContactSolution:
        tried.append(time)
        return solution(0.0, 0.0, SolveStatus.INDEFINITE, 20)

    assert not solve_eased(step, lambda time: Loads(), solution(0.0, 0.0), 1.0, AROUND).converged
    assert len(tried) <= 6


def test_only_what_nothing_holds_gives_way() -> None:
    def body(name: str, held: int, rides: bool = False) -> Any:
        return SimpleNamespace(
            name=name, prescribed=lambda *_: SimpleNamespace(degrees=np.arange(held)), rides=lambda time: rides
        )

    spans = {"FREE": slice(1, 3), "HELD": slice(3, 5), "LIFTED": slice(5, 6)}
    model: Any = SimpleNamespace(
        body=SimpleNamespace(mesh=SimpleNamespace(nodes=np.zeros((6, 3)))),
        objects=[body("FREE", 0), body("HELD", 3), body("LIFTED", 0, rides=True)],
        spans=spans,
    )
    around = around_free_objects(model, 0.0, 1.0)
    assert around is not None
    np.testing.assert_allclose(around, [0.0, 0.5, 0.5, 0.0, 0.0, 0.0])
    model.objects = model.objects[1:]
    assert around_free_objects(model, 0.0, 1.0) is None


@pytest.mark.parametrize(("held", "found"), [(0, True), (3, False)])
def test_load_steps_of_free_objects_alone_are_eased(held: int, found: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A load step fails without a medium, but for an object that something holds there is none."""
    pull, bounds = spring(5e-3, 4e-3, []), list[int]()

    def press(*known: Any, times: list[float], after: Any, solves: int | None, **_: Any) -> ContactSolution:
        bounds.append(solves or 0)
        return pull(after, times[0], known[3], True)

    monkeypatch.setattr(branch, "press", press)
    degrees = SimpleNamespace(degrees=np.arange(held))
    one = SimpleNamespace(name="BALL", prescribed=lambda *_: degrees, rides=lambda time: False)
    model: Any = SimpleNamespace(
        body=SimpleNamespace(mesh=SimpleNamespace(nodes=np.zeros((1, 3)))),
        pairs=[],
        objects=[one],
        spans={"BALL": slice(0, 1)},
        loads_at=lambda time, history: Loads(),
    )
    solved = branch.solve_onward(model, History(), solution(2.0, 0.0), [3.0], solves=400, ease=True)
    assert solved.converged == found
    assert max(bounds) <= 400
    if found:
        assert solved.last.displacement[0, 0] == pytest.approx(5e-3, rel=1e-9)
        assert solved.spent > 20
    else:
        assert bounds == [400]
