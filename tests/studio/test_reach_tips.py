"""A fingertip is brought to a place that the finger can reach, and no farther than its limits allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.script.staging import stage
from warpjld.studio.document import ScriptDocument
from warpjld.studio.hand_pose import COARSE, coarse_angles, coarse_share
from warpjld.studio.reach_tips import reach_tips, reach_wrist, tips
from warpjld.studio.state import StudioState

TEXT = "HAND LEFT BUILTIN RESOLUTION 1500\nMOVE LEFT 0 0.1 0.2 0.3\nTURN LEFT 0 20 40 60\n"


@pytest.fixture
def state(tmp_path: Path) -> StudioState:
    return StudioState(ScriptDocument(tmp_path / "a.jld", TEXT), tmp_path / "out")


def places(state: StudioState) -> dict[str, np.ndarray]:
    assert state.actor is not None
    positions = stage(state.actor, np.array([state.frame]), 30.0).positions[0]
    return {digit: positions[joint] for digit, joint in tips(state.actor, "left").items()}


@pytest.mark.parametrize("digit", ["thumb", "index", "pinky"])
def test_a_place_within_reach_is_reached_from_another_pose(state: StudioState, digit: str) -> None:
    state.do("POSE LEFT PINCH 0")
    target = places(state)[digit]
    state.undo()
    assert np.linalg.norm(places(state)[digit] - target) > 0.01
    before = places(state)
    assert state.set_angles(reach_tips(state.actor, "left", 0.0, {digit: target}))
    after = places(state)
    assert np.linalg.norm(after.pop(digit) - target) < 5e-4
    for other, place in after.items():
        assert np.array_equal(place, before[other])


def test_beyond_reach_the_finger_points_there_inside_its_limits(state: StudioState) -> None:
    state.do("POSE LEFT RELAXED 0")
    far = places(state)["index"] + np.array([0.0, 0.3, 0.0])
    found = reach_tips(state.actor, "left", 0.0, {"index": far})
    for channel, degrees in found.items():
        low, high = state.channels()[channel]
        assert low <= degrees <= high
    before = np.linalg.norm(places(state)["index"] - far)
    assert state.set_angles(found)
    assert np.linalg.norm(places(state)["index"] - far) < before


def test_with_a_free_wrist_the_pinned_tips_stay_while_one_is_dragged(state: StudioState) -> None:
    state.do("POSE LEFT CYLINDER 0")
    targets = places(state)
    targets["index"] = targets["index"] + np.array([0.004, 0.003, 0.0])
    assert state.set_angles(reach_tips(state.actor, "left", 0.0, targets, wrist=True))
    for digit, place in places(state).items():
        assert np.linalg.norm(place - targets[digit]) < 2e-3, digit


@pytest.mark.parametrize("name", COARSE)
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_coarse_shares_are_read_back_from_the_pose(state: StudioState, name: str, share: float) -> None:
    assert state.set_angles(coarse_angles(name, share, "left"))
    assert coarse_share(name, state.angles(), "left") == pytest.approx(share, abs=0.06)
    assert coarse_share(name, {}, "left") is None


def test_a_wrist_is_reached_by_the_joints_above_it_and_a_hand_alone_has_none(
    state: StudioState, tmp_path: Path
) -> None:
    assert state.actor is not None
    assert reach_wrist(state.actor, "left", 0.0, np.zeros(3)) == {}
    body = StudioState(ScriptDocument(tmp_path / "b.jld", "BODY BUILTIN\n"), tmp_path / "out")
    assert body.actor is not None
    wrist = body.actor.skeleton.names.index("left.wrist")

    def place() -> np.ndarray:
        return stage(body.actor, np.array([0.0]), 30.0).positions[0, wrist]

    target = place() + np.array([0.0, 0.05, 0.1])
    found = reach_wrist(body.actor, "left", 0.0, target)
    assert body.set_angles(found)
    assert np.linalg.norm(place() - target) < 2e-3
    for channel, degrees in found.items():
        low, high = body.channels()[channel]
        assert low <= degrees <= high
