"""Linear solves of grip searches: an equilibrium that is not found ends, in a search of any kind."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.squeeze import Squeeze
from warpjld.skeleton.channels import FLEXION


def test_an_equilibrium_takes_no_more_than_is_left() -> None:
    free = SearchBudget(None)
    assert (free.left, free.next, free.trial(80), free.trial(400)) == (None, 150, 150, 400)
    bound = SearchBudget(450)
    bound.spent = 350
    assert (bound.next, bound.trial(400), bound.exhausted) == (100, 100, False)
    bound.spent = 460
    assert (bound.next, bound.trial(400), bound.exhausted) == (0, 0, True)


@pytest.mark.parametrize(("steps", "most"), [(4, 150), (12, 240)])
def test_closing_without_a_bound_on_the_search_is_bounded(
    monkeypatch: pytest.MonkeyPatch, steps: int, most: int
) -> None:
    """The default bound of contact is 600 linear solves in vain for every step: four minutes of a whole hand."""
    asked: list[int | None] = []

    def unsolved(*_: Any, solves: int | None, **__: Any) -> Any:
        asked.append(solves)
        return SimpleNamespace(converged=False, spent=solves or 0)

    monkeypatch.setattr("warpjld.simulation.grip.squeeze.solve_branch", unsolved)
    skeleton = SimpleNamespace(limits=np.full((1, FLEXION + 1, 2), 2.0), names=["hand.index.base"])
    bones = SimpleNamespace(
        skeleton=skeleton, angles=lambda time: np.zeros((1, 4)), steps=lambda ends, travel: steps, moves_of=None
    )
    first: Any = SimpleNamespace(last=SimpleNamespace(time=0.0), converged=True)
    model: Any = SimpleNamespace()
    hand: Any = SimpleNamespace(name="hand", bones=bones)
    squeeze = Squeeze(model, History(), hand, [0], first)
    assert not squeeze.closed(0.01).converged
    assert asked == [most]
    assert squeeze.budget.spent == most
