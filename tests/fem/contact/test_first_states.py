"""Which points stick when a load step begins."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from warpjld.fem.contact import Pair
from warpjld.fem.contact.law.contact_state import ContactState, initial_state
from warpjld.fem.contact.solver.first_states import stuck_again


def state(pressure: list[float], sticking: list[bool]) -> ContactState:
    first = initial_state(len(pressure), Pair("a", "b"))
    return replace(first, pressure=np.array(pressure), sticking=np.array(sticking))


def sides(*friction: float) -> list[SimpleNamespace]:
    return [SimpleNamespace(pair=Pair("a", "b", friction=one)) for one in friction]


def test_all_points_stick_again_where_all_slid() -> None:
    """Those that are not pressed, or have no friction, stay as they were."""
    slid = [state([2.0, 0.0, 1.0], [False, False, False]), state([1.0], [False])]
    found = stuck_again(sides(0.3, 0.0), slid)  # type: ignore[arg-type]
    assert found[0].sticking.tolist() == [True, False, True]
    assert found[1].sticking.tolist() == [False]


def test_nothing_changes_where_a_point_sticks() -> None:
    """In either pair: what sticks resists already."""
    some = [state([2.0, 1.0], [False, False]), state([1.0], [True])]
    assert stuck_again(sides(0.3, 0.3), some) == some  # type: ignore[arg-type]
