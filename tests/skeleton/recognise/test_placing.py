"""Every kind of misplaced joint is found and named; a well-placed skeleton passes (R14)."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.skeleton import Skeleton, default_limits
from warpjld.skeleton.recognise.placing.check import check_placing


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
