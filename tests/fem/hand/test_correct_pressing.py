"""Correction and suggestion with real contact: a fingertip pressed on a plate by its finger's knuckles (R119, R120)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import Body, Prescribed, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.hand import hand_laws
from warpjld.fem.hand.blend import Moves, moves_of
from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.fingertip import Fingertip, build_fingertip
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.fem.hand.suggestions import DigitSlopes, suggestions
from warpjld.hand.kept import kept_hand
from warpjld.simulation.grip.correct import Correction, correct_angles
from warpjld.skeleton import Skeleton, poses_from_angles

JOINTS = ("index.base", "index.knuckle2", "index.knuckle3")
LIMITS = {"index": 5.0}


class PressedFinger:
    """An index fingertip whose bone follows its joints, over a plate that it just touches at rest."""

    def __init__(self, skeleton: Skeleton, tip: Fingertip) -> None:
        self.skeleton = skeleton
        self.near, self.far = skeleton.index("index.knuckle3"), skeleton.index("index.tip")
        self.body = Body(tip.mesh, hand_laws(tip.mesh.region_names))
        out = tip.facing(np.radians(25.0))
        first = tip.mesh.nodes[int(np.argmax(tip.mesh.nodes @ out))]
        self.out = out
        self.pair = Pair("tip", Plane(first, -out), name="plate")
        self.solves = 0
        self.solved: dict[bytes, ContactSolution] = {}

    def angles(self, degrees: float) -> NDArray[np.float64]:
        """The base flexed by these degrees, the other joints straight, shape (J, 4)."""
        angles = np.zeros((len(self.skeleton), 4))
        angles[self.skeleton.index("index.base"), 0] = np.radians(degrees)
        return angles

    def move(self, angles: NDArray[np.float64]) -> Moves:
        return moves_of(poses_from_angles(self.skeleton, angles[None]), 0, [self.near], self.skeleton.rest)

    def prescribed(self, angles: NDArray[np.float64]) -> Prescribed:
        nodes = self.body.mesh.node_set("held")
        x = self.body.mesh.nodes[nodes]
        moved = self.move(angles).of(np.zeros(len(nodes), np.int64), x)
        return prescribe(self.body.mesh, nodes, displacement=moved - x)

    def effort(self, angles: NDArray[np.float64]) -> Effort | None:
        """Close from rest, where the skin just touches."""
        self.solves += 1
        solution = press(
            self.body, lambda share: self.prescribed(share * angles), [self.pair], times=(0.5, 1.0), check=False
        )
        if not solution.converged:
            return None
        self.solved[angles.tobytes()] = solution
        return self.effort_of(angles, solution.last.displacement, solution.last.reactions)

    def effort_of(self, angles: NDArray[np.float64], u: NDArray[np.float64], reactions: NDArray[np.float64]) -> Effort:
        """Its one bone moves as a whole: the flesh alone takes nothing."""
        x = self.body.mesh.nodes + u
        loads = BoneLoads((self.far,), -reactions.sum(axis=0)[None], -np.cross(x, reactions).sum(axis=0)[None])
        return effort_of(self.skeleton, poses_from_angles(self.skeleton, angles[None]), loads, 0, LIMITS)

    def slopes(self, angles: NDArray[np.float64], ways: list[NDArray[np.float64]]) -> list[tuple[float, float]]:
        """Derivatives of the index finger's force and share along directions (J, 4) of angles that were solved."""
        solution, out = self.solved[angles.tobytes()], []
        tangent = EquilibriumTangent(self.body, [self.pair], solution, self.prescribed(angles).degrees)
        for way in ways:
            step, change = 1e-6, np.zeros(self.body.degrees)
            known = [self.prescribed(angles + sign * step * way) for sign in (1.0, -1.0)]
            change[known[0].degrees] = (known[0].values - known[1].values) / (2.0 * step)
            found, last = tangent.response(Perturbation(prescribed=change)), solution.last
            ends = [
                self.effort_of(
                    angles + by * way,
                    last.displacement + by * found.displacement,
                    last.reactions + by * found.reactions,
                )["index"]
                for by in (step, -step)
            ]
            out.append(((ends[0].force - ends[1].force) / (2.0 * step), (ends[0].share - ends[1].share) / (2.0 * step)))
        return out

    def joint_slopes(self, angles: NDArray[np.float64]) -> dict[str, DigitSlopes]:
        """As suggestions want them."""
        ways = np.zeros((3, *angles.shape))
        for k, joint in enumerate(JOINTS):
            ways[k, self.skeleton.index(joint), 0] = 1.0
        last = self.solved[angles.tobytes()].last
        force = self.effort_of(angles, last.displacement, last.reactions)["index"].force
        return {"left.index": DigitSlopes(force, np.array([slope for slope, _ in self.slopes(angles, [*ways])]))}


@pytest.fixture(scope="module")
def finger() -> PressedFinger:
    rig = kept_hand("left")
    return PressedFinger(rig.skeleton, build_fingertip(rig, "index", 0.002))


def test_the_finger_is_opened_until_the_plate_pushes_as_hard_as_it_may(finger: PressedFinger) -> None:
    wanted, opened = finger.angles(1.6), finger.angles(0.0)
    first = finger.effort(wanted)
    assert first is not None
    assert first["index"].share > 1.3
    finger.solves = 0

    def slopes(angles: NDArray[np.float64], ways: Mapping[str, NDArray[np.float64]]) -> dict[str, float]:
        return {"left.index": finger.slopes(angles, [ways["left.index"]])[0][1]}

    found = correct_angles(finger.effort, finger.skeleton, wanted, opened, slopes=slopes)
    assert found.status is Correction.CORRECTED
    assert found.effort is not None
    assert 0.95 <= found.effort["index"].share <= 1.0
    assert found.solves == finger.solves <= 4
    (by,) = found.opened.values()
    assert by[0] > 0.0
    assert not by[1:].any()


@pytest.mark.slow
def test_the_suggested_opening_lowers_the_force_as_far_as_said(finger: PressedFinger) -> None:
    before, now = finger.angles(1.4), finger.angles(1.6)
    first, second = finger.effort(before), finger.effort(now)
    assert first is not None
    assert second is not None
    slopes, earlier = finger.joint_slopes(now), finger.joint_slopes(before)
    for aim, known in ((0.8, earlier), (0.5, earlier), (0.8, None)):
        (only,) = suggestions(finger.skeleton, second, now, slopes, known, aim=aim)
        assert f"open {only.joint} by" in only.text
        assert "for" in only.text
        assert " N of 5 N" in only.text
        opened = now.copy()
        opened[finger.skeleton.index("index." + only.joint.replace(" ", "")), 0] -= only.opening
        after = finger.effort(opened)
        assert after is not None
        print(aim, after["index"].force / only.wanted)
        assert after["index"].force == pytest.approx(only.wanted, rel=0.05)
