"""Every kind of misplaced joint is found and named; a well-placed skeleton passes (R14)."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.skeleton import Skeleton, default_limits
from warpjld.skeleton.recognise.placing.check import check_placing
from warpjld.skeleton.recognise.placing.finding import Finding
from warpjld.skeleton.recognise.placing.symmetry import without_shared


def finger(positions: list[list[float]]) -> Skeleton:
    names = ("index.base", "index.knuckle2", "index.knuckle3", "index.tip")
    return Skeleton(
        tuple(f"left.{name}" for name in names),
        np.array([-1, 0, 1, 2], dtype=np.int32),
        np.array(positions),
        np.tile([1.0, 0.0, 0.0], (4, 1)),
        default_limits(names),
    )


@pytest.fixture(scope="module")
def tube() -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.capsule(height=0.08, radius=0.008, count=(32, 32))
    vertices = np.array(mesh.vertices)
    return vertices - [0, 0, vertices[:, 2].min() + 0.008], np.array(mesh.faces)


GOOD = [[0, 0, 0.005], [0, 0, 0.03], [0, 0, 0.055], [0, 0, 0.08]]


def test_a_finger_in_the_middle_passes(tube):
    assert check_placing(finger(GOOD), *tube) == ()


@pytest.mark.parametrize(
    ("joint", "place", "kind", "name"),
    [
        (1, [0.0, 0.02, 0.03], "outside", "left.index.knuckle2"),
        (1, [0.0, -0.006, 0.03], "off-centre", "left.index.knuckle2"),
        (2, [0.0, 0.0, 0.03], "coincident", "left.index.knuckle3"),
        (3, [0.0, 0.0, 0.0865], "extremity", "left.index.tip"),
        (3, [0.0, 0.0, 0.06], "extremity", "left.index.tip"),
    ],
)
def test_a_misplaced_joint_is_named(tube, joint, place, kind, name):
    positions = [list(p) for p in GOOD]
    positions[joint] = place
    findings = check_placing(finger(positions), *tube)
    assert (name, kind) in {(f.joint, f.kind) for f in findings}
    message = next(f.message for f in findings if f.kind == kind)
    assert name in message


def test_a_segment_that_leaves_the_surface_is_named():
    bent = trimesh.creation.annulus(r_min=0.03, r_max=0.05, height=0.02, sections=64)
    turn = np.radians([0, 20, 40, 180])
    ring = np.stack([0.04 * np.cos(turn), 0.04 * np.sin(turn), 0 * turn], axis=1)
    findings = check_placing(finger(ring.tolist()), np.array(bent.vertices), np.array(bent.faces))
    assert [f.joint for f in findings if f.kind == "leaves"] == ["left.index.tip"]


def test_the_mouth_of_an_open_wrist_counts_as_inside(tube):
    vertices, faces = tube
    opened = faces[vertices[faces].mean(axis=1)[:, 2] > 0.004]
    findings = check_placing(finger([[0, 0, 0.004], *GOOD[1:]]), vertices, opened)
    assert not [f for f in findings if f.kind == "outside"]


def test_a_root_before_the_end_of_the_surface_is_well_placed(tube):
    """As a wrist at the end of a hand without a forearm; far from it, it is outside."""
    near, far = ([[0, 0, z], *GOOD[1:]] for z in (-0.0075, -0.02))
    assert check_placing(finger(near), *tube) == ()
    assert [one.kind for one in check_placing(finger(far), *tube)] == ["outside"]


def test_a_deviation_that_both_sides_share_is_the_design_of_a_rig():
    names = ("shoulder", "elbow", "wrist", "knee", "ankle")
    joints = {f"left.{name}": np.array([0.2 + 0.1 * k, 1.0 - 0.2 * k, 0.0]) for k, name in enumerate(names)}
    joints |= {f"right.{name}": joints[f"left.{name}"] * [-1.0, 1.0, 1.0] for name in names}
    both = [Finding(f"{side}.knee", "proportion", 0.1, excess=1.5) for side in ("left", "right")]
    one = Finding("left.wrist", "off-centre", 0.6)
    assert without_shared([*both, one], joints, 1.8) == [one]
    # but not what only one side has, or what both have too much of, or where the joints are no mirror images
    too_much = [Finding(f"{side}.knee", "proportion", 0.1, excess=2.5) for side in ("left", "right")]
    assert without_shared(too_much, joints, 1.8) == too_much
    moved = joints | {"left.knee": joints["left.knee"] + [0.0, 0.05, 0.0]}
    assert without_shared(both, moved, 1.8) == both


def test_of_several_segments_that_leave_the_surface_the_common_joint_is_named(tube):
    names = ("thumb.base", "index.base", "middle.base", "ring.base")
    rest = np.array([[0, 0, 0.0], [0.05, 0, 0.03], [-0.05, 0, 0.03], [0, 0, 0.03]])
    vertices, faces = tube
    parts = [vertices, vertices + np.array([0.05, 0, 0]), vertices - np.array([0.05, 0, 0])]
    skeleton = Skeleton(
        names, np.array([-1, 0, 0, 0], dtype=np.int32), rest, np.tile([0.0, 1, 0], (4, 1)), default_limits(names)
    )
    findings = check_placing(
        skeleton, np.concatenate(parts), np.concatenate([faces + k * len(vertices) for k in range(3)])
    )
    assert [(one.joint, one.kind) for one in findings if one.kind in ("begins", "leaves")] == [("thumb.base", "begins")]
