"""Poses of a skin: what is inside, how deep, and which parts cross, beside brute force."""

import numpy as np
import pytest

from tests.grasp.oracle import signed_distance
from warpjld.covering.intersections import crossing_faces
from warpjld.covering.quality import closing_fans
from warpjld.grasp import GraspObject, Places
from warpjld.grasp.point_groups import grouped_points
from warpjld.grasp.posed_skins import PosedSkins
from warpjld.skeleton import CHANNELS, poses_from_angles


@pytest.fixture(scope="module")
def skins(covering) -> np.ndarray:
    """A flat hand, a fist whose digits pass through one another, and one between."""
    skeleton = covering.skeleton
    angles = np.zeros((3, len(skeleton), len(CHANNELS)))
    for joint, name in enumerate(skeleton.names):
        if name.endswith(("base", "knuckle2", "knuckle3")):
            angles[:, joint, 0] = np.array([0.0, 0.5, 0.95]) * skeleton.limits[joint, 0, 1]
    return covering.deform(poses_from_angles(skeleton, angles))


def test_depths_are_those_of_the_skin_with_its_wrist_closed(covering, skins) -> None:
    posed, place = PosedSkins(covering), Places.of((0.05, -0.02, 0.01), (0.2, 0.1, 0.4, 0.8))
    rng = np.random.default_rng(0)
    boundary, loop = closing_fans(covering.surface.faces)
    for skin in skins:
        points = place.to_local(skin[rng.integers(len(skin), size=80)] + rng.uniform(-0.008, 0.008, size=(80, 3)))[0]
        local = place.to_local(skin)[0]
        rims = [local[boundary[loop == k, 0]].mean(axis=0) for k in range(int(loop.max(initial=-1)) + 1)]
        whole = np.concatenate([local, np.reshape(rims, (-1, 3))])
        fans = np.stack([boundary[:, 1], boundary[:, 0], len(skin) + loop], axis=1)
        solid = GraspObject("skin", whole, np.concatenate([covering.surface.faces, fans]).astype(np.int32))
        exact = signed_distance(points, solid)
        fitted = posed.fitted(skin[None], place)
        own = np.zeros(len(covering.surface.faces), dtype=np.int32)
        for n, wanted in enumerate(exact):
            gaps = np.full((1, len(posed.parts.names)), np.inf)
            one = grouped_points(points[n : n + 1])
            posed.least_distances(fitted, one, own, gaps, near=1.0, limit=1.0, outside=True)
            assert gaps[0, 0] == pytest.approx(wanted, abs=1e-7) or np.isinf(gaps[0, 0])  # a fan is no part


def test_crossings_are_those_of_every_pair(covering, skins) -> None:
    posed = PosedSkins(covering)
    found = posed.crossings(skins)
    for skin, table in zip(skins, found, strict=True):
        pairs = crossing_faces(skin, covering.surface.faces).contact(posed.parts).pairs
        exact = np.zeros_like(table)
        np.add.at(exact, tuple(posed.parts.of_face[pairs].T), 1)
        np.testing.assert_array_equal(table, exact + exact.T)
    assert found[2].any()
    # limits of all sizes: none, what there is, and one less
    rng = np.random.default_rng(0)
    most = np.maximum(found - rng.integers(0, 3, found.shape), 0)
    most = np.triu(most, 1) + np.triu(most, 1).transpose(0, 2, 1)
    np.testing.assert_array_equal(posed.cross_more(skins, most), found > most)
    for part in range(len(posed.parts.names)):
        asked = np.full(3, part, dtype=np.int32)
        more = posed.part_crosses_more(skins, asked, most[:, part])
        np.testing.assert_array_equal(more, (found > most)[:, part].any(axis=1))


def test_a_pose_is_what_it_is_alone(covering, skins) -> None:
    posed = PosedSkins(covering)
    alone = [posed.crossings(skin[None])[0] for skin in skins]
    posed.most = 2  # blocks
    np.testing.assert_array_equal(posed.crossings(skins), alone)
