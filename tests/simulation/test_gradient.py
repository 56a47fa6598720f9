"""Gradients of a simulation against the last frame solved again: a fingertip that slides over a plate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactSolution
from warpjld.rig import Rig
from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.sensitivity.parameters import Friction, JointAngle, Modulus, ObjectPlace
from warpjld.simulation.simulate import Simulation, simulate
from warpjld.simulation.solve import branch
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.solve.solved_frame import solved_frame
from warpjld.simulation.specification import ContactSpecification, FleshMaterial, SolveSpecification

EXACT = 1e-3
STEP = 2e-4


@pytest.fixture(scope="module", autouse=True)
def _tight() -> Iterator[None]:
    """Differences of forces want them exact."""
    with mock.patch.object(branch, "_TOLERANCE", 1e-9):
        yield


def pressing(rig: Rig) -> Simulation:
    """Down by 6.3 mm, then half a hundredth of a millimetre more and a millimetre aside: most points slide."""
    root = np.zeros((4, 3))
    root[:, 1] = [0.0, -0.005, -0.0063, -0.00635]
    root[3, 0] = 1e-3
    hand = RecordedActor("hand", rig, angles=np.zeros((4, len(rig.skeleton), 4)), root=root)
    plate = RecordedObject("plate", trimesh.creation.box((0.036, 0.006, 0.036)), positions=(0.034, -0.0275, -0.165))
    contact = ContactSpecification(
        flesh={"hand": FleshMaterial(digits=("index",), element=0.004)},
        pressing=SolveSpecification(0, 3),
        everywhere=0.2,
    )
    return simulate(contact, RecordedAnimation([hand], [plate]))


@pytest.fixture(scope="module")
def pressed(fine: Rig) -> Simulation:
    return pressing(fine)


def again(pressed: Simulation, angles: NDArray[np.float64]) -> ContactSolution:
    """The last frame from the one before, at other angles (J, 4)."""
    known, before = pressed.solved.equilibria[3.0], pressed.solved.equilibria[2.0].solution
    (hand,) = known.model.hands
    time = known.solution.last.time
    moves = hand.bones.moves_of(angles, time)
    hand = replace(hand, moves=lambda now: moves if now == time else known.model.hands[0].moves(now))
    found = solve_onward(replace(known.model, hands=(hand,)), known.history, before, [time])
    assert found.converged
    return found


@pytest.mark.parametrize("joint", ["index.knuckle3", pytest.param("index.base", marks=pytest.mark.slow)])
def test_a_joint_s_angle_against_the_frame_solved_again(pressed: Simulation, joint: str) -> None:
    check_angle(pressed, joint)


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["index.knuckle3", "index.base"])
def test_a_point_that_touches_in_the_last_step_does_not_hold_the_others(rig: Rig, joint: str) -> None:
    pressed = pressing(rig)
    (state, _) = pressed.solved.equilibria[3.0].solution.states
    assert (state.open_before & state.sticking & (state.pressure > 0.0)).any()
    check_angle(pressed, joint)


def check_angle(pressed: Simulation, joint: str) -> None:
    known = pressed.solved.equilibria[3.0]
    model, (hand,), time = known.model, known.model.hands, known.solution.last.time
    (state, _) = known.solution.states
    assert (state.sticking & (state.pressure > 0.0)).any()
    assert (~state.sticking & (state.pressure > 0.0)).sum() > 2
    found = pressed.gradient(3.0, [JointAngle("hand", joint)])
    forces, bones, pressures = [], [], []
    for sign in (1.0, -1.0):
        angles = hand.bones.angles(time).copy()
        angles[hand.bones.skeleton.index(joint), 0] += sign * STEP
        end = again(pressed, angles)
        effort = effort_at(model, hand, hand.bones.posed(angles, time), end.last)["index"]
        forces.append(end.last.touches[0].nodal.sum(axis=0))
        bones.append([effort.force, *effort.torques])
        pressures.append(solved_frame(3.0, [end.last]).pressure(model))
    got = [found.digits("hand")["left.index"][0], *found.torques("hand")["left.index"][0]]
    for name, values, derivative in (
        ("force", forces, found.force("hand")[0]),
        ("bone", bones, got),
        ("pressure", pressures, found.pressure[0]),
    ):
        difference = (np.array(values[0]) - values[1]) / (2.0 * STEP)
        atol = EXACT * np.abs(difference).max()
        np.testing.assert_allclose(derivative, difference, rtol=0, atol=atol, err_msg=f"{joint} {name}")


def test_what_follows_from_mechanics(pressed: Simulation) -> None:
    """Without a second solve: friction that slides, what moves as a whole, moduli that all grow."""
    found = pressed.gradient(
        3.0, [Friction("plate", "hand"), Modulus("hand"), ObjectPlace("plate", 1), Modulus("hand", "hand.flesh")]
    )
    count = len(pressed.model.body.mesh.nodes)
    assert found.displacement.shape == found.reactions.shape == found.contact_force.shape == (4, count, 3)
    assert found.pressure.shape == (4, count)
    rougher, stiffer, raised, skin = found.force("hand")
    assert rougher[0] < 0.0  # it slid to +x
    # prescribed displacements and Coulomb's friction alone: forces are in proportion to all moduli
    np.testing.assert_allclose(stiffer, pressed.force("hand")[-1], rtol=2e-3)
    assert 0.0 < skin[1] < stiffer[1]
    assert raised[1] > 0.0
    # reactions balance contact
    np.testing.assert_allclose(found.reactions.sum(axis=1), -found.contact_force.sum(axis=1), atol=1e-6 * raised[1])


def test_what_cannot_be_is_refused_by_name(pressed: Simulation) -> None:
    with pytest.raises(InputError, match=r"frame: want one that this run solved \(1, 2, 3\), got 9"):
        pressed.gradient(9.0, [Modulus("hand")])
    for parameter, words in (
        (Modulus("plate"), "nothing called plate deforms"),
        (Modulus("hand", "bone"), "no region 'bone'"),
        (JointAngle("plate", "index.base"), "no flesh of 'plate'"),
        (JointAngle("hand", "index.base", "bend"), "channel: want one of"),
        (ObjectPlace("ball", 0), "no object 'ball'"),
        (ObjectPlace("plate", 3), "axis: want 0, 1 or 2"),
        (Friction("plate", "ball"), "no pair that may touch"),
    ):
        with pytest.raises(InputError, match=words):
            pressed.gradient(3.0, [parameter])
    with pytest.raises(InputError, match="at least one"):
        pressed.gradient(3.0, [])
    with pytest.raises(InputError, match="no flesh of 'plate' here"):
        pressed.gradient(3.0, [Modulus("hand")]).digits("plate")
