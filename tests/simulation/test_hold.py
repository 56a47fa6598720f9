"""A block that two pads take from its support: what is held, what slides, and what stands on something else."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import Body, LinearElastic, Prescribed, box_hexes, merge, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.contact.sensitivity.equilibrium_tangent import SensitivityError
from warpjld.fem.load.loads import Loads
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel, PairOwners
from warpjld.simulation.bodies.object_body import build_object_body
from warpjld.simulation.grip.hand_trials import HandTrials
from warpjld.simulation.grip.search import GripStatus, TrialOutcome, gentlest_grip
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.specification import GripSpecification

WEIGHT, FRICTION = 0.6, 0.5
EDGE, PAD = 0.03, (0.004, 0.024, 0.024)


@dataclass(frozen=True, eq=False)
class Pads:
    """In place of a hand: two soft pads whose backs close by a way [m]."""

    mesh: HexMesh
    moves: Callable[[float], float]
    name: str = "PADS"

    def prescribed(self, time: float, history: History) -> Prescribed:
        way = self.moves(time)
        left = prescribe(self.mesh, "left.back", x=way, y=0.0, z=0.0)
        return left + prescribe(self.mesh, "right.back", x=-way, y=0.0, z=0.0)

    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: object
    ) -> NDArray[np.float64]:
        return displacement

    def timed(self, clock: Callable[[float], float]) -> Pads:
        return replace(self, moves=lambda time: self.moves(clock(time)))


class Squeeze:
    """In place of a hand's joints: grips are ways of the pads' backs."""

    def __init__(self, model: ContactModel) -> None:
        self.model, self.hand, self.history = model, model.hands[0], History()
        self.time, self.budget = 1.0, SearchBudget()

    @cached_property
    def first(self) -> ContactSolution:
        known, loads = (lambda time: self.model.prescribed(time, History())), self.model.loads_at(0.0, History())
        return press(self.model.body, known, self.model.pairs, lambda time: loads, times=(1.0,))

    def closes(self, before: float, grip: float) -> tuple[str, Callable[[float], float]]:
        return self.hand.name, lambda share: before + share * (grip - before)

    def steps(self, before: float, grip: float, travel: float) -> int:
        return max(1, math.ceil((grip - before) / travel))

    def stays(self, grip: float) -> tuple[str, Callable[[float], float]]:
        return self.hand.name, lambda share: grip

    def tangent(self, grip: float, closed: ContactSolution) -> None:
        raise SensitivityError("not of ways")

    def effort(self, grip: float, instant: object) -> SimpleNamespace:
        return SimpleNamespace(digits=[SimpleNamespace(share=0.1, digit="pad")])


def pads() -> HexMesh:
    parts = []
    for name, start, skin, back in (("left", -0.5 * EDGE - PAD[0], "x+", "x-"), ("right", 0.5 * EDGE, "x-", "x+")):
        pad = box_hexes(PAD, (1, 2, 2), origin=(start, -0.5 * PAD[1], -0.5 * PAD[2]), name=f"{name}.flesh")
        parts.append(replace(pad, faces={f"pad.{name}": pad.faces[skin], f"{name}.back": pad.faces[back]}))
    return merge(*parts)


@pytest.fixture
def lift() -> HandTrials:
    """A block of 0.6 N on a foot between the pads; gravity along -z."""
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(
        f"OBJECT BLOCK BOX {EDGE} {EDGE} {EDGE} AT 0 0 0\nGRAVITY 0 0 -9.81\n"
        f"PHYSICAL BLOCK LAW LINEAR YOUNG 1000000 POISSON 0.3 DENSITY {WEIGHT / 9.81 / EDGE**3} ELEMENT 0.01\n"
    )
    scene.contact.grips.append(GripSpecification("PADS", "BLOCK", 1.0, 5.0, (), 0.1, lift=True))
    block = build_object_body(SceneAnimation(scene).objects["BLOCK"], scene.contact, 0.0)
    hand = Pads(pads(), lambda time: 0.0)
    mesh = merge(hand.mesh, block.mesh)
    count = len(hand.mesh.nodes)
    laws = {name: LinearElastic(6e4, 0.3) for name in ("left.flesh", "right.flesh")}
    body = Body(mesh, {**laws, **block.laws})
    pairs = tuple(Pair(f"pad.{side}", block.faces, FRICTION) for side in ("left", "right"))
    owner = PairOwners("PADS", "BLOCK")
    spans = {"PADS": slice(0, count), "BLOCK": slice(count, len(mesh.nodes))}
    loads = Loads(gravity=(0.0, 0.0, -9.81))
    model = ContactModel((hand,), (block,), {}, body, spans, pairs, (owner, owner), loads)  # type: ignore[arg-type]
    return HandTrials(Squeeze(model), block)  # type: ignore[arg-type]


def test_a_block_that_rode_along_rests_in_a_firm_grip(lift: HandTrials) -> None:
    trial = lift(1.5e-4)
    assert trial.held
    assert trial.force > WEIGHT / FRICTION
    last = lift.found[1.5e-4].last
    np.testing.assert_allclose(sum(touch.force for touch in last.touches), [0.0, 0.0, -WEIGHT], atol=1e-3 * WEIGHT)
    assert not last.reactions[lift.weight.handle].any()


@pytest.mark.slow
def test_the_gentlest_grip_takes_the_block_from_its_foot(lift: HandTrials) -> None:
    assert lift.weight.weight == pytest.approx(WEIGHT, rel=1e-6)
    found = gentlest_grip(lift, 2e-5, 1e-3, weight=WEIGHT, friction=FRICTION, start=1e-4, tolerance=0.05)
    assert found.status is GripStatus.HELD, found.ended
    assert 0.98 * WEIGHT / (2.0 * FRICTION) <= 0.5 * found.trial.force <= 1.08 * WEIGHT / (2.0 * FRICTION)
    assert len(found.trials) <= 6
    gentler = [trial for grip, trial in found.trials if grip < found.grip]
    assert gentler
    assert all(trial.outcome in (TrialOutcome.WEAK, TrialOutcome.SLIDES) for trial in gentler)
    taken = lift.taken(found.grip)
    assert taken is not None
    lowered, instant = taken
    assert -2e-3 < lowered < 0.0
    force = sum(touch.force for touch in instant.touches)
    np.testing.assert_allclose(force, [0.0, 0.0, -WEIGHT], atol=1e-3 * WEIGHT)
    assert not instant.reactions[lift.weight.handle].any()


@pytest.mark.parametrize("solves", [0, 8])  # 0: not one load step of closing is solved
def test_a_search_ends_with_its_linear_solves(lift: HandTrials, solves: int) -> None:
    lift.budget = lift.squeeze.budget = lift.ride.budget = SearchBudget(solves)
    found = gentlest_grip(
        lift,
        5e-5,
        1e-3,
        weight=WEIGHT,
        friction=FRICTION,
        tolerance=1e-4,
        exhausted=lambda: lift.budget.exhausted,
    )
    assert found.status is GripStatus.EXHAUSTED, (found.status, found.ended)
    assert lift.budget.exhausted
    assert lift.budget.spent < solves + 10  # an equilibrium may end some solves late: damping repeats one
    assert found.text.startswith(GripStatus.EXHAUSTED.value)


def test_a_block_with_a_floor_below_stands_on_it(lift: HandTrials) -> None:
    model = lift.squeeze.model
    floor = Plane((0.0, 0.0, -0.5 * EDGE - 5e-5), (0.0, 0.0, 1.0))
    squeeze = Squeeze(
        replace(
            model,
            pairs=(*model.pairs, Pair(model.objects[0].faces, floor, FRICTION)),
            owners=(*model.owners, PairOwners("BLOCK", "FLOOR")),
        )
    )
    standing = HandTrials(squeeze, model.objects[0])  # type: ignore[arg-type]
    trial = standing(1.5e-4)
    assert trial.outcome is TrialOutcome.STANDS
    assert trial.note.startswith("FLOOR bears ")
    assert standing.taken(1.5e-4) is None
    assert not math.isnan(trial.sliding)
