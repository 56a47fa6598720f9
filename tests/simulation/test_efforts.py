"""What the bones bear of a finger that bends on a plate: against the plate's own account, and without a measure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem.hand.bone_loads import loads_from_contact
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.report.table import ContactTable
from warpjld.simulation.simulate import Simulation
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.skeleton import Poses

BENDING = """
OBJECT plate BOX 0.05 0.006 0.05 AT 0.034 -0.0275 -0.155
MOVE LEFT 0 0 0.001 0
MOVE LEFT 10 0 -0.005 0
FINGER23 LEFT INDEX KNUCKLES2 AT 0 0
FINGER23 LEFT INDEX KNUCKLES2 AT 10 12
GRAVITY 0 -9.81 0
FLESH LEFT INDEX ELEMENT 0.004
FRAMES 0 5
PRESS 0 5 EVERY 2
"""
TOLERANCE = 1e-3
"""Of the contact force; contact itself is solved to a tenth of it."""


@dataclass(frozen=True, eq=False)
class Bending:
    """The script above, made."""

    scene: Scene
    report: Simulation

    @property
    def bodies(self) -> ContactModel:
        return self.report.model

    @property
    def hand(self) -> FleshBody:
        return self.bodies.hands[0]

    @property
    def frames(self) -> tuple[SolvedFrame, ...]:
        return self.report.solved.frames

    def poses(self, solved: SolvedFrame) -> Poses:
        return self.hand.bones.pose(solved.frame - self.bodies.start)

    def effort(self, solved: SolvedFrame) -> Effort:
        return effort_at(self.bodies, self.hand, self.poses(solved), solved)

    def contact(self, solved: SolvedFrame) -> NDArray[np.float64]:
        return np.asarray(solved.nodal.sum(axis=0)[self.bodies.spans[self.hand.name]])


@pytest.fixture(scope="module")
def bending(rig, tmp_path_factory: pytest.TempPathFactory) -> Bending:
    scene = Scene(say=lambda text: None)
    scene.add("left", rig)
    Interpreter(scene).run_text(BENDING)
    return Bending(scene, run_contact(scene, tmp_path_factory.mktemp("bending")))


def test_bones_bear_what_the_plate_puts_on_the_finger(bending: Bending) -> None:
    pressed = [solved for solved in bending.frames if solved.nodal.any()]
    assert len(pressed) >= 2
    for solved in pressed:
        force = bending.contact(solved).sum(axis=0)
        effort = bending.effort(solved)
        borne = effort.palm + np.sum([digit.load for digit in effort.digits], axis=0)
        np.testing.assert_allclose(borne, force, atol=TOLERANCE * float(np.linalg.norm(force)))
        rows = {row.digit: row for row in bending.report.rows if row.frame == solved.frame}
        assert rows["index"].bone_n == pytest.approx(effort["index"].force)
        assert rows["palm"].bone_n == pytest.approx(np.linalg.norm(effort.palm))
        assert rows["index"].bone_n == pytest.approx(rows["index"].force_n, rel=TOLERANCE)
        assert np.isnan(rows["palm"].flesh_n)
        assert np.isnan(rows["palm"].limit_n)
    assert 0.5 < np.linalg.norm(bending.contact(pressed[-1]).sum(axis=0)) < 50.0


def test_torques_are_those_of_the_plate(bending: Bending) -> None:
    """About the base: the plate's forces times their levers. What the flesh alone takes is a part of the reactions."""
    solved = bending.frames[-1]
    span, poses = bending.bodies.spans[bending.hand.name], bending.poses(solved)
    effort = bending.effort(solved)
    contact, flesh = bending.contact(solved), bending.hand.hand
    skeleton = bending.hand.bones.skeleton
    x = flesh.mesh.nodes + solved.displacement[span]
    joint = skeleton.index("index.base")
    before = int(skeleton.parents[joint])
    from scipy.spatial.transform import Rotation

    axis = Rotation.from_quat(poses.rotations[0, before]).apply(skeleton.axes[joint])
    torque = -np.cross(x - poses.positions[0, joint], contact).sum(axis=0) @ axis
    assert effort["index"].torques[0] == pytest.approx(torque, rel=5e-3)
    assert effort["index"].flesh > 0.05
    handed = effort_of(skeleton, poses, loads_from_contact(flesh, solved.displacement[span], contact))
    assert handed["index"].force == pytest.approx(effort["index"].force, rel=0.02)
    np.testing.assert_allclose(handed["index"].torques[:2], effort["index"].torques[:2], rtol=0.05)


def test_frames_without_contact_ask_nothing_of_muscles(bending: Bending) -> None:
    free = [solved for solved in bending.frames if not solved.nodal.any()]
    for solved in free:
        assert bending.effort(solved).share == 0.0


def test_without_a_measure_contact_is_handed_on_and_said_so(bending: Bending, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bending.hand.alone, "at", lambda *_: None)
    table = ContactTable(bending.scene.contact.strength)
    solved = bending.frames[-1]
    table.add(bending.bodies, solved)
    row = next(row for row in table.rows if row.digit == "index")
    assert np.isnan(row.flesh_n)
    assert row.bone_n == pytest.approx(row.force_n, rel=0.05)
    (note,) = table.notes()
    assert f"no equilibrium in the pose of frame {solved.frame:g}" in note
    assert not any("estimated" in one for one in bending.report.notes)


def test_muscles_stop_and_suggest_by_what_bones_bear(bending: Bending, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 1 N: the run stops, and it is said which joint to open."""
    monkeypatch.setitem(bending.scene.contact.strength, "LEFT", {"index": 1.0})
    table = ContactTable(bending.scene.contact.strength)
    told = [table.add(bending.bodies, solved) for solved in bending.frames]
    solved = bending.frames[-1]
    borne = bending.effort(solved)["index"].force
    assert told[:-1] == [None] * (len(told) - 1)
    assert told[-1] is not None
    assert told[-1].startswith(
        f"stopped at frame {solved.frame:g}: more than muscles can do: left.index {borne:.3g} N of"
    )
    (found,) = table.suggestions(bending.bodies)
    assert f"left.index {borne:.3g} N of 1 N" in found.text
    assert "open " in found.text
    assert found.joint == ""  # no stiffness is given here, so that no joint can be named
