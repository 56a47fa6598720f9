"""Muscles' work against statics: a bent finger, its own flesh strained, pushed by a force whose lever is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem import Body, Loads, Prescribed, solve
from warpjld.fem.hand import FleshHand, hand_laws
from warpjld.fem.hand.alone import FleshAlone, Untouched
from warpjld.fem.hand.bone_loads import loads_from_reactions
from warpjld.fem.hand.muscles import effort_of
from warpjld.simulation.bodies.rest_shape import cut_to_digits
from warpjld.skeleton import Poses, poses_from_angles, rest_poses

FORCE = 2.0
"""Newtons on the pad."""
BEND = {"index.base": 30.0, "index.knuckle2": 40.0, "index.knuckle3": 20.0}
TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Pushed:
    """An index finger that was bent, then pushed on its pad, away from the palm."""

    hand: FleshHand
    cut: NDArray[np.int64]
    body: Body
    poses: Poses
    known: Prescribed
    push: NDArray[np.float64]
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]

    def alone(self) -> FleshAlone:
        return FleshAlone(self.hand, self.body, self.known.degrees, self.hand.rest_pose())

    def untouched(self, alone: FleshAlone) -> Untouched:
        found = alone.at(self.poses, self.displacement, self.reactions, self.push)
        assert found is not None
        return found


@pytest.fixture(scope="module")
def pushed(hand: FleshHand) -> Pushed:
    skeleton = hand.skeleton
    part = cut_to_digits(hand, rest_poses(skeleton), hand.surface.vertices, ["index"])
    finger = part.hand
    angles = np.zeros((1, len(skeleton), 4))
    for joint, degrees in BEND.items():
        angles[0, skeleton.index(joint), 0] = np.radians(degrees)
    poses = poses_from_angles(skeleton, angles)
    moves = finger.moves(poses)
    known = finger.prescribed_by(moves)
    cut = np.setdiff1d(part.cut, known.degrees // 3)
    x = finger.mesh.nodes[cut]
    followed = (moves.blended(finger.weights[cut], x) - x).ravel()
    known = known + Prescribed((3 * cut[:, None] + np.arange(3)).ravel(), followed)
    body = Body(finger.mesh, hand_laws(finger.mesh.region_names))
    bent = solve(body, known, guess=finger.guess(moves.still(), moves), tolerance=TOLERANCE)
    near, far = skeleton.index("index.knuckle3"), skeleton.index("index.tip")
    turn = Rotation.from_quat(poses.rotations[0, near])
    away = turn.apply(np.cross(skeleton.directions[near], skeleton.axes[near]))
    pad = np.flatnonzero(finger.node_labels == finger.label_names.index("left.index.distal"))
    at = finger.mesh.nodes[pad] + bent.displacement[pad]
    pad = pad[(at - 0.5 * (poses.positions[0, near] + poses.positions[0, far])) @ away < -0.003]
    push = np.zeros_like(finger.mesh.nodes)
    push[pad] = FORCE * away / len(pad)
    found = solve(body, known, Loads(nodal=push), after=bent, tolerance=TOLERANCE)
    return Pushed(finger, cut, body, poses, known, push, found.displacement, found.reactions)


def torques_by_statics(pushed: Pushed) -> NDArray[np.float64]:
    """Force times lever about every joint [N m], shape (3,): the force is known, its place is where the nodes went."""
    skeleton = pushed.hand.skeleton
    x = pushed.hand.mesh.nodes + pushed.displacement
    out = []
    for name in BEND:
        joint = skeleton.index(name)
        axis = Rotation.from_quat(pushed.poses.rotations[0, skeleton.parents[joint]]).apply(skeleton.axes[joint])
        out.append(-np.cross(x - pushed.poses.positions[0, joint], pushed.push).sum(axis=0) @ axis)
    return np.array(out)


def test_torques_are_force_times_lever(pushed: Pushed) -> None:
    """Moments balance: what the bones beyond a joint do not bear of it, those before the joint do. So far from the push
    that is next to nothing. Reactions with what the flesh alone takes would be a third off."""
    hand, skeleton = pushed.hand, pushed.hand.skeleton
    untouched = pushed.untouched(pushed.alone())
    held = loads_from_reactions(hand, pushed.displacement, pushed.reactions)
    own = loads_from_reactions(hand, untouched.displacement, untouched.reactions)
    loads = held - own
    index = effort_of(skeleton, pushed.poses, loads, flesh=own)["index"]
    expected = torques_by_statics(pushed)
    chain = [skeleton.index(name) for name in BEND]
    for k, joint in enumerate(chain):
        before = ~np.isin(loads.bones, [*chain[k + 1 :], skeleton.index("index.tip")])
        passed = loads.moment[before] - np.cross(pushed.poses.positions[0, joint], loads.force[before])
        bound = float(np.linalg.norm(passed, axis=1).sum()) + 10.0 * TOLERANCE
        assert abs(index.torques[k] - expected[k]) <= bound
        assert bound < 2e-2 * expected[k]
    assert index.force == pytest.approx(FORCE, rel=1e-4)
    beyond = np.isin(own.bones, [*chain[1:], skeleton.index("index.tip")])
    assert index.flesh == pytest.approx(np.linalg.norm(own.force[beyond].sum(axis=0)))
    raw = effort_of(skeleton, pushed.poses, held)["index"]
    assert raw.torques[0] > 1.25 * expected[0]
    assert raw.force > 1.5 * FORCE


def test_forces_balance_where_flesh_is_cut_off(pushed: Pushed) -> None:
    """Pushed beside the cut: what it bears goes to the bones that move it, the palm's among them."""
    hand, x = pushed.hand, pushed.hand.mesh.nodes
    untouched = pushed.untouched(pushed.alone())
    outer = np.setdiff1d(np.unique(hand.mesh.quads(hand.skin_faces)), pushed.known.degrees // 3)
    away = np.linalg.norm(x[outer][:, None] - x[pushed.cut], axis=2).min(axis=1)
    push = np.zeros_like(x)
    push[outer[away < 0.006], 1] = 1.0 / (away < 0.006).sum()
    found = solve(pushed.body, pushed.known, Loads(nodal=push), guess=untouched.displacement, tolerance=TOLERANCE)
    on_cut = (found.reactions - untouched.reactions)[pushed.cut].sum(axis=0)
    assert -on_cut[1] > 0.25
    loads = loads_from_reactions(hand, found.displacement, found.reactions)
    loads = loads - loads_from_reactions(hand, untouched.displacement, untouched.reactions)
    np.testing.assert_allclose(loads.force.sum(axis=0), push.sum(axis=0), atol=1e-5)
    turning = np.cross(x + found.displacement, push).sum(axis=0)
    np.testing.assert_allclose(loads.moment.sum(axis=0), turning, atol=1e-6)
    effort = effort_of(hand.skeleton, pushed.poses, loads)
    assert 0.1 < effort.palm[1] < -on_cut[1]
    digits = np.sum([digit.load for digit in effort.digits], axis=0)
    np.testing.assert_allclose(digits + effort.palm, push.sum(axis=0), atol=1e-5)


def test_one_way_leads_where_another_does(pushed: Pushed) -> None:
    """From rest in one go, by a pose between, and back from a farther one: the same flesh. A pose once known stays."""
    direct = pushed.alone()
    found = pushed.untouched(direct)
    assert pushed.untouched(direct) is found
    nothing = np.zeros_like(pushed.push)
    for share in (0.5, 1.4):
        alone = pushed.alone()
        assert alone.at(*_posed(pushed, share), nothing, pushed.push) is not None
        other = pushed.untouched(alone)
        np.testing.assert_allclose(other.displacement, found.displacement, atol=1e-7)
        np.testing.assert_allclose(other.reactions, found.reactions, atol=1e-4)


def test_a_hand_that_nothing_touches_is_its_own_measure(pushed: Pushed) -> None:
    nothing = np.zeros_like(pushed.push)
    found = pushed.alone().at(pushed.poses, pushed.displacement, pushed.reactions, nothing)
    assert found is not None
    assert found.displacement is pushed.displacement
    assert found.reactions is pushed.reactions


def test_a_pose_that_crushes_its_flesh_has_no_equilibrium(pushed: Pushed) -> None:
    """Joints bent so far that bones meet: said so, after as many tries as are worth it."""
    assert pushed.alone().at(*_posed(pushed, 4.0), np.zeros_like(pushed.push), pushed.push) is None


def test_other_shapes_are_refused(pushed: Pushed) -> None:
    with pytest.raises(InputError, match=r"contact: want shape \(\d+, 3\), got \(5, 3\)"):
        pushed.alone().at(pushed.poses, pushed.displacement, pushed.reactions, pushed.push[:5])


def _posed(pushed: Pushed, share: float) -> tuple[Poses, NDArray[np.float64]]:
    """The finger on its way to the pose, or beyond, and displacements right on prescribed nodes (N, 3)."""
    skeleton, hand = pushed.hand.skeleton, pushed.hand
    angles = np.zeros((1, len(skeleton), 4))
    for joint, degrees in BEND.items():
        angles[0, skeleton.index(joint), 0] = share * np.radians(degrees)
    poses = poses_from_angles(skeleton, angles)
    out = np.zeros_like(hand.mesh.nodes)
    nodes = pushed.known.degrees[::3] // 3
    out[nodes] = hand.moves(poses).blended(hand.weights[nodes], hand.mesh.nodes[nodes]) - hand.mesh.nodes[nodes]
    return poses, out
