"""Defaults that keep volume."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.covering.tube import AROUND, RADIUS, bend, tube, tube_skeleton
from warpjld.covering import bind
from warpjld.covering.parameters import default_parameters, load_parameters
from warpjld.covering.quality import Stretch, edge_stretch, enclosed_volume, reversed_edges, unique_edges
from warpjld.errors import InputError
from warpjld.rig import Rig

SURFACE = tube()


@pytest.mark.parametrize("limit", [45.0, 60.0, 90.0])
def test_a_tube_keeps_its_volume_at_every_angle(limit: float) -> None:
    skeleton = tube_skeleton(limit)
    angles = [limit * part for part in (0.25, 0.5, 0.75, 1.0)]
    points = bind(skeleton, SURFACE).deform(bend(skeleton, angles))
    change = enclosed_volume(points, SURFACE.faces) / enclosed_volume(SURFACE.vertices, SURFACE.faces) - 1.0
    assert np.abs(change).max() < 0.02


def test_a_tube_at_ninety_degrees() -> None:
    """Volume within 2 %, the joint as thick as at rest, no edge below half of its length, none reversed.

    Diffusion rounds the outer edge of the bend, which costs some of its height; blend skinning leaves .71 of it, and
    .71 on the inside."""
    skeleton = tube_skeleton()
    poses = bend(skeleton, [90.0])
    points = bind(skeleton, SURFACE).deform(poses)[0]
    change = enclosed_volume(points, SURFACE.faces) / enclosed_volume(SURFACE.vertices, SURFACE.faces) - 1.0
    assert abs(change) < 0.02
    # thickness: how far the joint's section reaches along the bisector's normal, and to the sides
    section = points[30 * AROUND : 31 * AROUND] - poses.positions[0, 1]
    normal = np.array([0.0, np.sqrt(0.5), -np.sqrt(0.5)])
    assert (section @ normal).max() >= 0.8 * RADIUS
    assert -(section @ normal).min() >= RADIUS * (1.0 - 1e-6)
    assert np.ptp(section @ normal) >= 2.0 * RADIUS * (1.0 - 1e-6)
    assert np.ptp(section[:, 0]) >= 2.0 * RADIUS * (1.0 - 1e-6)
    edges = unique_edges(SURFACE.faces)
    stretch = Stretch.of(edge_stretch(SURFACE.vertices, points, edges))
    assert stretch.smallest >= 0.5
    assert stretch.largest < 1.6
    before = (SURFACE.vertices[:, 2] > skeleton.rest[1, 2])[:, None]
    carried = np.where(before, poses.rotations[0, 0], poses.rotations[0, 1])
    assert not reversed_edges(SURFACE.vertices, points, edges, carried).any()


def test_a_small_joint_inflates_little(built: Rig) -> None:
    skeleton = built.skeleton
    inflation = default_parameters(skeleton).inflation
    knuckle, metacarpal = (inflation[skeleton.index(n)] for n in ("pinky.knuckle2", "pinky.carpometacarpal"))
    assert 0.0 < metacarpal < 0.06 * knuckle
    assert inflation[skeleton.index("index.tip")] == 0.0


def test_defaults_are_in_range(built: Rig) -> None:
    default_parameters(built.skeleton).check(built.skeleton)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('{"joints": []}', "want a JSON object with a 'joints' object"),
        ('{"joints": {"index.base": 3}}', "want a JSON object with a 'joints' object"),
        ('{"joints": {"indx.base": {}}}', "did you mean index.base?"),
        ('{"joints": {"index.base": {"peek": 0.5}}}', "unknown parameter 'peek'; did you mean peak?"),
        ('{"joints": {"index.base": {"peak": "high"}}}', "'peak' wants a number, got 'high'"),
        ('{"joints": {"index.base": {"proximity": [0.9, 0.9]}}}', "at most 1"),
        ("\x89PNG", "is not UTF-8 text"),
    ],
)
def test_wrong_files_are_named(built: Rig, tmp_path: Path, content: str, says: str) -> None:
    path = tmp_path / "p.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(InputError) as caught:
        load_parameters(path, built.skeleton)
    assert caught.value.path == path
    assert says in str(caught.value)


def test_the_thumbs_base_counts_by_its_whole_swing(built: Rig) -> None:
    """It flexes little and swings far: by its flexion alone nothing of the thumb's ball would swell."""
    skeleton = built.skeleton
    inflation = default_parameters(skeleton).inflation
    thumb, finger = (skeleton.index(f"left.{name}") for name in ("thumb.base", "index.carpometacarpal"))
    flexion, abduction = skeleton.limits[thumb, [0, 3], 1]
    swing = np.hypot(flexion, abduction)
    loss = [1.0 - np.sin(x / 2) / (x / 2) for x in (swing, np.pi / 2)]
    assert abduction > flexion
    assert inflation[thumb] == pytest.approx(3.0 * 0.1 * loss[0] / loss[1])
    assert inflation[finger] < 0.1 * inflation[thumb]
