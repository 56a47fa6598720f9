"""Muscles against springs whose forces are known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fem.hand.spring_fingers import SpringFingers
from warpjld.errors import InputError
from warpjld.fem import Body, solve
from warpjld.fem.hand import FleshHand, hand_laws
from warpjld.fem.hand.bone_loads import BoneLoads, loads_from_contact, loads_from_reactions
from warpjld.fem.hand.limits import FORCE_LIMITS, force_limits
from warpjld.fem.hand.muscles import effort_of
from warpjld.fem.hand.suggestions import DigitSlopes, suggestions
from warpjld.fem.load.loads import Loads
from warpjld.hand.kept import kept_hand
from warpjld.simulation.grip.correct import Correction, correct_angles
from warpjld.skeleton import Skeleton, rest_poses


@pytest.fixture(scope="module")
def skeleton() -> Skeleton:
    return kept_hand("left", resolution=2500).skeleton


def curl(skeleton: Skeleton, degrees: float, *digits: str) -> NDArray[np.float64]:
    angles = np.zeros((len(skeleton), 4))
    for digit in digits or ("index", "middle"):
        for joint in ("base", "knuckle2", "knuckle3"):
            angles[skeleton.index(f"{digit}.{joint}"), 0] = np.radians(degrees)
    return angles


def test_torques_of_a_known_force(skeleton: Skeleton) -> None:
    """Rest, force on the pad against the palm's side: each joint bears the force times its distance along the digit."""
    poses = rest_poses(skeleton)
    tip, third = skeleton.index("index.tip"), skeleton.index("index.knuckle3")
    pad = 0.5 * (skeleton.rest[tip] + skeleton.rest[third])
    base = skeleton.index("index.base")
    along = pad - skeleton.rest[base]
    back = np.cross(along, skeleton.axes[base])
    force = 20.0 * back / np.linalg.norm(back)
    loads = BoneLoads((tip,), force[None], np.cross(pad, force)[None])
    effort = effort_of(skeleton, poses, loads)
    index = effort["index"]
    assert index.force == pytest.approx(20.0)
    assert index.torques[0] == pytest.approx(20.0 * np.linalg.norm(along))
    assert (np.diff(index.torques) < 0.0).all()
    assert (index.torques > 0.0).all()
    assert index.share == pytest.approx(20.0 / 59.0, rel=0.05)
    assert effort["ring"].force == 0.0
    assert effort.realistic
    assert effort.stop() is None
    assert "index 20 N of 59 N" in effort.text
    strong = effort_of(skeleton, poses, loads, limits={"index": 10.0})
    assert not strong.realistic
    assert strong.stop() is not None
    assert strong["index"].share == pytest.approx(2.0, rel=0.05)


def test_reactions_and_contact_agree_on_what_muscles_bear(hand: FleshHand) -> None:
    """A fingertip pushed by a known force on its skin: reactions of the solve, and the force handed on, give its torque
    about the base."""
    body = Body(hand.mesh, hand_laws(hand.mesh.region_names))
    name = "left.index.distal"
    chosen = np.flatnonzero(hand.node_labels == hand.label_names.index(name))
    push = np.zeros_like(hand.mesh.nodes)
    palm = -np.cross(hand.skeleton.directions, hand.skeleton.axes)[hand.skeleton.index("index.base")]
    push[chosen] = -0.5 * palm / len(chosen)
    poses = rest_poses(hand.skeleton)
    found = solve(body, hand.prescribed(poses), Loads(nodal=push), tolerance=1e-9)
    held = loads_from_reactions(hand, found.displacement, found.reactions)
    given = loads_from_contact(hand, found.displacement, push)
    np.testing.assert_allclose(held.force.sum(axis=0), push.sum(axis=0), atol=1e-6)
    np.testing.assert_allclose(given.force.sum(axis=0), push.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(held.moment.sum(axis=0), given.moment.sum(axis=0), atol=1e-6)
    by_reactions = effort_of(hand.skeleton, poses, held)["index"]
    by_contact = effort_of(hand.skeleton, poses, given)["index"]
    assert by_reactions.force == pytest.approx(0.5, rel=0.02)
    assert by_contact.force == pytest.approx(0.5, rel=0.02)
    np.testing.assert_allclose(by_reactions.torques, by_contact.torques, rtol=0.05, atol=1e-4)


def slopes_of(fingers: SpringFingers, skeleton: Skeleton, angles: NDArray[np.float64]) -> dict[str, DigitSlopes]:
    """By differences."""
    slopes = np.zeros(3)
    for k, joint in enumerate(("base", "knuckle2", "knuckle3")):
        turn = np.zeros_like(angles)
        turn[skeleton.index(f"index.{joint}"), 0] = 1e-6
        ends = [fingers.effort(angles + sign * turn)["index"].force for sign in (1.0, -1.0)]
        slopes[k] = (ends[0] - ends[1]) / 2e-6
    return {"left.index": DigitSlopes(fingers.effort(angles)["index"].force, slopes)}


def test_suggested_opening_brings_the_wanted_force(skeleton: Skeleton) -> None:
    fingers = SpringFingers(skeleton, {"index": 8e3, "middle": 1e3}, curl(skeleton, 30.0))
    before, now = curl(skeleton, 31.0), curl(skeleton, 32.0)
    second = fingers.effort(now)
    with_limit = {"index": second["index"].force / 1.2}
    second = fingers.effort(now, with_limit)
    known, earlier = (slopes_of(fingers, skeleton, angles) for angles in (now, before))
    found = suggestions(skeleton, second, now, known, earlier)
    assert [s.digit for s in found] == ["left.index"]
    (only,) = found
    assert only.wanted == pytest.approx(second["index"].force * 0.5 / second["index"].share)
    assert f"open {only.joint} by" in only.text
    opened = now.copy()
    opened[skeleton.index("index." + only.joint.replace(" ", "")), 0] -= only.opening
    assert fingers.effort(opened)["index"].force == pytest.approx(only.wanted, rel=0.05)

    (unknown,) = suggestions(skeleton, second, now)
    assert "no stiffness is known" in unknown.text


def test_correction_opens_only_what_bears_too_much(skeleton: Skeleton) -> None:
    fingers = SpringFingers(skeleton, {"index": 9e3, "middle": 0.5e3}, curl(skeleton, 30.0))
    wanted, back = curl(skeleton, 40.0), curl(skeleton, 10.0)
    assert fingers.effort(wanted)["index"].share > 2.0
    solved = []

    def solve_at(angles: NDArray[np.float64]):  # type: ignore[no-untyped-def]
        solved.append(angles)
        return fingers.effort(angles)

    done = correct_angles(solve_at, skeleton, wanted, back)
    assert done.status is Correction.CORRECTED
    assert done.effort is not None
    assert 0.95 <= done.effort["index"].share <= 1.0
    assert set(done.opened) == {"left.index"}
    assert done.solves == len(solved) <= 8
    np.testing.assert_array_equal(fingers.effort(done.angles)["index"].torques, done.effort["index"].torques)

    fine = correct_angles(fingers.effort, skeleton, curl(skeleton, 30.5), back)
    assert fine.status is Correction.NOT_NEEDED
    assert fine.solves == 1

    hopeless = correct_angles(fingers.effort, skeleton, wanted, curl(skeleton, 39.0))
    assert hopeless.status is Correction.TOO_STRONG_WHEN_OPEN
    unsolved = correct_angles(lambda _: None, skeleton, wanted, back)
    assert unsolved.status is Correction.NO_SOLUTION


def test_what_cannot_be_is_refused(skeleton: Skeleton) -> None:
    assert force_limits({"thumb": 103.0})["thumb"] == 103.0
    assert force_limits() == FORCE_LIMITS
    with pytest.raises(InputError, match="no digit 'indx'; did you mean index"):
        force_limits({"indx": 3.0})
    with pytest.raises(InputError, match="newtons above 0, got nan"):
        force_limits({"index": float("nan")})
    with pytest.raises(InputError, match="0 < aim"):
        correct_angles(lambda _: None, skeleton, curl(skeleton, 1.0), curl(skeleton, 0.0), aim=0.0)
