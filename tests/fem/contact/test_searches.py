"""How a search for an equilibrium begins, goes on, and is given up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.fem.contact.bodies import lid
from warpjld.fem import Body, LinearElastic, box_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.interface.contact_area import contact_modulus
from warpjld.fem.contact.interface.contact_interface import interfaces_of
from warpjld.fem.contact.law.contact_state import initial_state
from warpjld.fem.contact.solver.contact_newton import ContactNewton
from warpjld.fem.contact.solver.contact_system import LoadStep
from warpjld.fem.contact.solver.newton_state import NewtonState
from warpjld.fem.load.loads import Loads
from warpjld.fem.solver.krylov import SolveStatus


class Pressed:
    """A block under a plate that comes down by a tenth, and its one load step."""

    def __init__(self) -> None:
        mesh = box_hexes(counts=(2, 2, 2))
        self.body = Body(mesh, LinearElastic(1.0, 0.3))
        pairs = [Pair("z+", lid(0.1))]
        interfaces = interfaces_of(mesh, pairs, 1)
        moduli = [contact_modulus(self.body, interface) for interface in interfaces]
        self.newton = ContactNewton(self.body, interfaces, moduli, tolerance=1e-6, penetration=1e-3)
        held = prescribe(mesh, "z-", x=0.0, y=0.0, z=0.0)
        self.step = LoadStep(0.0, 1.0, held, Loads(), 0.0)
        self.states = [initial_state(len(interfaces[0].edge), pairs[0])]
        self.start = np.zeros(self.body.degrees)

    def find(self, *guesses: np.ndarray) -> Any:
        return self.newton.find(self.start, self.states, self.step, *guesses)


def test_a_search_begins_where_the_least_force_is_left_over(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Pressed()
    status, known = case.find()
    assert status is SolveStatus.CONVERGED
    begun: list[np.ndarray] = []
    usual = ContactNewton._search

    def search(self: ContactNewton, state: NewtonState, step: LoadStep) -> Any:
        begun.append(state.u.copy())
        return usual(self, state, step)

    monkeypatch.setattr(ContactNewton, "_search", search)
    wild = known.displacement + 0.05 * np.sin(7.0 * np.arange(case.body.degrees))
    near = 0.98 * known.displacement
    status, found = case.find(wild, near)
    assert status is SolveStatus.CONVERGED
    assert len(begun) == 1
    np.testing.assert_array_equal(begun[0], near)
    np.testing.assert_allclose(found.displacement, known.displacement, atol=1e-5)


def test_where_guesses_are_in_vain_it_begins_at_the_last_equilibrium(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Pressed()
    begun: list[np.ndarray] = []
    usual = ContactNewton._search

    def search(self: ContactNewton, state: NewtonState, step: LoadStep) -> Any:
        begun.append(state.u.copy())
        return usual(self, state, step) if len(begun) > 1 else (SolveStatus.MAX_ITERATIONS, None)

    monkeypatch.setattr(ContactNewton, "_search", search)
    assert case.find(case.start + 1e-3)[0] is SolveStatus.CONVERGED
    np.testing.assert_array_equal(begun[1], case.start)


def test_a_search_that_never_comes_near_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Pressed()
    looked = []
    usual = NewtonState.assemble

    def assemble(self: NewtonState) -> None:
        usual(self)
        self.unbalanced = 0.31
        self._near = False
        looked.append(self.turn)

    monkeypatch.setattr(NewtonState, "assemble", assemble)
    status, found = case.find()
    assert found is None
    assert status is SolveStatus.MAX_ITERATIONS
    assert looked == list(range(11))


def test_one_that_goes_round_is_ended_and_stays_careful(monkeypatch: pytest.MonkeyPatch) -> None:
    case = Pressed()
    careful = []
    usual = NewtonState.confirmed

    def confirmed(self: NewtonState) -> bool:
        monkeypatch.setattr(self.system, "mismatch", lambda *points: 1.0)  # never as they were believed to be
        out = usual(self)
        careful.append(self.alternating)
        return out

    monkeypatch.setattr(NewtonState, "confirmed", confirmed)
    assert case.find()[1] is None
    assert careful == [True, True, True]


def test_steps_that_fail_again_after_each_halving_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven halvings in a row are allowed, but a success makes room for another: only the bound ends such a run."""
    usual = ContactNewton.find

    def find(self: ContactNewton, u: Any, states: Any, step: LoadStep, *guesses: Any) -> Any:
        if step.time - step.before > 0.01:
            self.solves += 40
            return SolveStatus.INDEFINITE, None
        return usual(self, u, states, step, *guesses)

    monkeypatch.setattr(ContactNewton, "find", find)
    case = Pressed()
    found = press(case.body, case.step.prescribed, [Pair("z+", lid(0.1))], check=False)
    assert found.status is SolveStatus.EXHAUSTED
    assert 600 <= found.spent - sum(found.steps) < 640
    assert "600 were spent in vain; the last failure: the stiffness is not positive definite" in found.message


def test_a_run_ends_with_its_linear_solves() -> None:
    case = Pressed()
    pairs, times = [Pair("z+", lid(0.1))], [0.25, 0.5, 0.75, 1.0]
    whole = press(case.body, case.step.prescribed, pairs, times=times)
    assert whole.spent == sum(whole.steps) > 4
    short = press(case.body, case.step.prescribed, pairs, times=times, solves=whole.spent - 1, check=False)
    assert short.status is SolveStatus.EXHAUSTED
    assert short.spent == whole.spent - 1
    assert 1 <= len(short.instants) < 4
