"""A head turns as a whole: what is painted on its bone alone goes with it, eyes and lids together."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from warpjld.covering import Covering
from warpjld.covering.kept import bind_kept
from warpjld.covering.skull import skull_lines
from warpjld.geometry.rotations import rotate
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, poses_from_angles

BODIES = (
    "body_anny/body_104joints.glb",
    "body_mesh2motion_mannequin/human-male.glb",
)


@pytest.fixture(scope="module")
def bodies(data: Path) -> Callable[[str], tuple[Rig, Covering]]:
    """A body and its covering by its file's name; each is bound once."""

    @cache
    def bound_body(name: str) -> tuple[Rig, Covering]:
        rig = load_rig(data / name)
        return rig, bind_kept(rig)[0]

    return bound_body


def lag(rig: Rig, covering: Covering, channel: str, degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Distance [m] of every vertex from where the head's bone alone would take it, and how far it would take it."""
    skeleton = rig.skeleton
    head = skeleton.index("head")
    angles = np.zeros((1, len(skeleton), len(CHANNELS)))
    angles[0, head, CHANNELS.index(channel)] = np.radians(degrees)
    poses = poses_from_angles(skeleton, angles)
    rest = rig.surface.vertices
    whole = poses.positions[0, head] + rotate(poses.rotations[0, head], rest - skeleton.rest[head])
    moved = covering.deform(poses)[0]
    return np.linalg.norm(moved - whole, axis=1), np.linalg.norm(whole - rest, axis=1)


def painted_on(rig: Rig, *joints: str) -> np.ndarray:
    assert rig.skin is not None
    mine = np.isin(rig.skin.joints, [rig.skeleton.index(name) for name in joints])
    return (rig.skin.weights * mine).sum(axis=1) > 0.99


@pytest.mark.parametrize(
    ("channel", "degrees"), [("flexion", 40), ("flexion", -35), ("twisting", 50), ("abduction", 30)]
)
@pytest.mark.parametrize("name", [BODIES[0], pytest.param(BODIES[1], marks=pytest.mark.slow)])
def test_what_is_painted_on_the_head_goes_with_it(
    bodies: Callable[[str], tuple[Rig, Covering]], name: str, channel: str, degrees: float
) -> None:
    rig, covering = bodies(name)
    off, way = lag(rig, covering, channel, degrees)
    base = rig.skeleton.rest[rig.skeleton.index("head")]
    head = painted_on(rig, "head", "head.top") & (way > 1e-3)
    assert np.median(off[head] / way[head]) < 0.06  # by half before
    above = head & (rig.surface.vertices[:, 1] > base[1])
    assert np.quantile(off[above], 0.9) < 0.006


def test_lids_stay_on_the_eyes(bodies: Callable[[str], tuple[Rig, Covering]]) -> None:
    rig, covering = bodies(BODIES[0])
    assert rig.rigid is not None
    eyes, flesh = np.flatnonzero(rig.rigid >= 0), np.flatnonzero(rig.rigid < 0)
    near = cKDTree(rig.surface.vertices[eyes]).query(rig.surface.vertices[flesh])[0] < 0.004
    off, _ = lag(rig, covering, "twisting", 50)
    assert off[eyes].max() < 1e-6
    assert off[flesh[near]].max() < 5e-4


def test_hands_have_no_skull(hands: dict[str, Rig]) -> None:
    rig = hands["left"]
    assert skull_lines(rig.skeleton, rig.surface.vertices, rig.surface.faces) == []
