"""The built-in hand's flesh closes on a ball: contact, muscles and touch together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.covering import bind
from warpjld.fem import Body, NeoHooke, SolveStatus, ball_hexes, merge, prescribe
from warpjld.fem.contact import ContactInstant, Pair, press
from warpjld.fem.contact.obstacles.solids import Sphere
from warpjld.fem.hand import FleshHand, FleshMotion, build_flesh_hand, hand_laws, motion_of
from warpjld.fem.hand.alone import FleshAlone
from warpjld.fem.hand.bone_loads import BoneLoads, loads_from_contact, loads_from_reactions
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.factor import Factor
from warpjld.grasp import Places
from warpjld.grasp.close import Closer
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.postures import posture_angles
from warpjld.grasp.shapes import ball
from warpjld.hand import build_hand
from warpjld.simulation.report.tactile import tactile_of
from warpjld.skeleton import poses_from_angles

pytestmark = pytest.mark.slow

CENTRE = np.array([0.004, -0.0495, -0.062])
RADIUS = 0.0325


@pytest.fixture(scope="module")
def closing() -> FleshMotion:
    """The hand closes until its skin touches at time 3, and on by 5° in every joint until time 4."""
    rig = build_hand("left")
    hand = build_flesh_hand(rig)
    skeleton = rig.skeleton
    start = posture_angles(skeleton, "left", "sphere")[None]
    closer = Closer(bind(skeleton, rig.surface), ball(2.0 * RADIUS))
    open_hand = poses_from_angles(skeleton, start)
    closed = closer.close(open_hand, start, places=Places.of(CENTRE), coupling=(1.0, 0.7)).angles
    more = closed.copy()
    more[:, np.unique(list(digit_chains(skeleton).values())), 0] += np.radians(5.0)
    shares = np.array([1.0, 2.0, 3.0])[:, None, None] / 3.0
    angles = np.concatenate([start + shares * (closed - start), more])
    return motion_of(hand, poses_from_angles(skeleton, angles))


def loads_at(motion: FleshMotion, alone: FleshAlone, instant: ContactInstant) -> BoneLoads:
    hand, count = motion.hand, len(motion.hand.mesh.nodes)
    nodal = np.sum([t.nodal for t in instant.touches], axis=0)[:count]
    u, reactions = instant.displacement[:count], instant.reactions[:count]
    untouched = alone.at(motion.pose(instant.time), u, reactions, nodal)
    assert untouched is not None
    own = loads_from_reactions(hand, untouched.displacement, untouched.reactions)
    return loads_from_reactions(hand, u, reactions) - own


def loads_in_first_order(motion: FleshMotion, alone: FleshAlone, instant: ContactInstant) -> BoneLoads:
    """Loads of contact by another way: reactions K₂₁ K₁₁⁻¹ f, K the tangent of the flesh without contact."""
    hand, count = motion.hand, len(motion.hand.mesh.nodes)
    force = instant.touches[0].nodal[:count]
    without = alone.at(motion.pose(instant.time), instant.displacement[:count], instant.reactions[:count], force)
    assert without is not None
    stiffness = alone.body.at(without.displacement).stiffness
    assert stiffness is not None
    free = Prescribed(alone.degrees, np.zeros(len(alone.degrees))).free(alone.body.degrees)
    move = Factor(stiffness, free, threads=1).solve(force.ravel())
    reactions = np.where(free, 0.0, stiffness.product(move, threads=1))
    return loads_from_reactions(hand, without.displacement, reactions.reshape(-1, 3))


def passed_on(hand: FleshHand, digit: str, nodal: NDArray[np.float64]) -> float:
    """Contact force on skin that moves with a digit but that weights hand to other bones, or the reverse [N].

    Which bones bear it depends on its direction, which weights know nothing of: at the base of the thumb, 3 %.
    """
    names = [hand.skeleton.names[bone] for bone in hand.flesh.bones]
    own = [
        k for k, name in enumerate(names) if name.startswith(digit) and not name.endswith(("base", "carpometacarpal"))
    ]
    weight = hand.weights[:, own].sum(axis=1)
    return float(np.linalg.norm(nodal[: len(weight)], axis=1) @ np.minimum(weight, 1.0 - weight))


def effort(motion: FleshMotion, loads: BoneLoads, time: float) -> Effort:
    return effort_of(motion.hand.skeleton, motion.pose(time), loads)


def balanced(hand: FleshHand, instant: ContactInstant) -> None:
    """Contact and bones hold the flesh between them, to a hundredth of the tolerance of the forces that bend it."""
    touch = instant.touches[0].nodal[: len(hand.mesh.nodes)].sum(axis=0)
    held = float(np.linalg.norm(instant.reactions, axis=1).sum())
    bones = loads_from_reactions(hand, instant.displacement, instant.reactions).force.sum(axis=0)
    np.testing.assert_allclose(touch, bones, atol=1e-3 * instant.touches[0].normal_force + 1e-7 * held)


def test_rigid_ball(closing: FleshMotion) -> None:
    """Flesh at rest in the open hand is strained when it closes, by newtons at the thumb: they do not count."""
    hand = closing.hand
    body = Body(hand.mesh, hand_laws(hand.mesh.region_names))
    alone = FleshAlone(hand, body, closing.prescribed(0.0).degrees, closing.pose(0.0))

    def watch(instant: ContactInstant) -> str | None:
        return effort(closing, loads_at(closing, alone, instant), instant.time).stop()

    found = press(
        body,
        closing.prescribed,
        [Pair("hand", Sphere(CENTRE, RADIUS), name="ball")],
        times=[1.0, 2.0, 3.0, 3.1, 3.2, 3.3, 3.4],
        guess=closing.guess,
        watch=watch,
        check=False,
    )
    assert found.status in (SolveStatus.CONVERGED, SolveStatus.STOPPED)
    assert found.last.time >= 3.2
    for instant in found.instants:
        assert instant.touches[0].penetration < 1e-3 * 0.003
        balanced(hand, instant)
        touch = instant.touches[0]
        loads = loads_at(closing, alone, instant)
        np.testing.assert_allclose(loads.force.sum(axis=0), touch.nodal.sum(axis=0), atol=1e-3 * touch.normal_force)
        first_order = effort(closing, loads_in_first_order(closing, alone, instant), instant.time)
        by_weights = effort(closing, loads_from_contact(hand, instant.displacement, touch.nodal), instant.time)
        # what both equilibria leave over: this one, and that without contact (``FleshAlone``)
        noise = instant.residual * np.linalg.norm(instant.reactions, axis=1).sum() + 1e-4 * touch.normal_force
        for digit in effort(closing, loads, instant.time).digits:
            there, shared = first_order[digit.digit], by_weights[digit.digit]
            np.testing.assert_allclose(there.load, digit.load, rtol=0.0, atol=1e-3 * digit.force + noise)
            if touch.normal_force < 0.1:  # later what is pressed in moves the forces by a share of their lever arms
                np.testing.assert_allclose(there.torques, digit.torques, rtol=0.01, atol=0.1 * noise)
            passed = 2.0 * passed_on(hand, digit.digit, touch.nodal)
            np.testing.assert_allclose(shared.load, digit.load, rtol=0.0, atol=1e-3 * digit.force + passed + noise)
    read = tactile_of(hand, found.instants)
    assert not read.touching[:2].any()
    for name in ("pinky", "ring", "middle", "index", "thumb"):
        assert read.touching[-1, read.pads.index(f"left.{name}.distal")]
    assert (np.diff(read.normal_force[2:].sum(axis=1)) > 0.0).all()
    assert read.normal_force[-1].sum() == pytest.approx(found.last.touches[0].normal_force, rel=1e-9)


def test_deformable_ball(closing: FleshMotion) -> None:
    """Held inside: without friction nothing else would keep it between the fingers."""
    hand = closing.hand
    thing = ball_hexes(RADIUS, n=6)
    inside = np.flatnonzero(np.linalg.norm(thing.nodes, axis=1) < 0.01)
    thing = replace(
        thing,
        nodes=thing.nodes + CENTRE,
        regions=np.zeros_like(thing.regions),
        region_names=("ball",),
        faces={"ball": thing.boundary()},
        node_sets={"inside": inside.astype(np.int32)},
    )
    mesh = merge(hand.mesh, thing)
    laws = hand_laws(mesh.region_names) | {"ball": NeoHooke(60e3, 0.45)}
    found = press(
        Body(mesh, laws),
        lambda time: closing.prescribed(time) + prescribe(mesh, "inside", x=0.0, y=0.0, z=0.0),
        [Pair("hand", "ball", name="ball")],
        times=[1.0, 2.0, 3.0, 3.1, 3.2, 3.3],
        guess=closing.guess,
        check=False,
    )
    assert found.status is SolveStatus.CONVERGED
    balanced(hand, found.last)
    touch = found.last.touches[0]
    both = touch.nodal.sum(axis=0)
    np.testing.assert_allclose(both, 0.0, atol=1e-6 * touch.normal_force)
    assert touch.normal_force > 1.0
