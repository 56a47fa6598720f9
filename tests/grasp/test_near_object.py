"""Bounds from a grid leave exact distances as they are."""

import numpy as np
import pytest

from tests.grasp.oracle import signed_distance
from warpjld.grasp import ObjectSet
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import make_object
from warpjld.grasp.shapes import ball, box, cylinder, glass


def open_box():
    """A box without its lid: no solid."""
    thing = box(0.06, 0.05, 0.04, edge=0.01)
    kept = thing.vertices[thing.faces][:, :, 1].min(axis=1) < thing.size[1] / 2 - 1e-9
    return make_object("tray", thing.vertices, thing.faces[kept])


THINGS = {"ball": lambda: ball(0.05, subdivisions=3), "glass": glass, "box": box, "open": open_box}


def cloud(thing, count: int) -> np.ndarray:
    """Half near the surface, half anywhere about the object."""
    rng = np.random.default_rng(0)
    face = rng.integers(len(thing.faces), size=count // 2)
    on = np.einsum("nk,nki->ni", rng.dirichlet([1, 1, 1], size=count // 2), thing.vertices[thing.faces[face]])
    near = on + thing.normals[face] * rng.uniform(-0.004, 0.004, size=(count // 2, 1))
    far = rng.uniform(-1.2, 1.2, size=(count - count // 2, 3)) * thing.size
    return np.concatenate([near, far])


@pytest.mark.parametrize("name", THINGS)
def test_near_points_have_their_distances(name: str) -> None:
    thing = THINGS[name]()
    points = cloud(thing, 600)
    whole = ObjectSet(thing).distances(points)
    found = NearObject(thing).near(points, 1e-3)
    measured = found.face >= 0
    assert measured[whole.distance[0] <= 1e-3].all()
    assert (~measured).any()
    np.testing.assert_allclose(found.distance[measured], whole.distance[0][measured], atol=1e-8)
    assert np.isinf(found.distance[~measured]).all()


@pytest.mark.parametrize("name", ["ball", "open"])
def test_the_least_of_many_is_the_least_by_brute_force(name: str) -> None:
    thing = THINGS[name]().placed((0.2, 0.1, -0.3), (0.1, 0.2, 0.3, 0.9))
    rng = np.random.default_rng(1)
    clouds = thing.place.apply(cloud(thing, 120))[0] + rng.uniform(-0.03, 0.03, size=(3, 1, 3))
    near = NearObject(thing)
    exact = [signed_distance(thing.place.to_local(points)[0], thing).min() for points in clouds]
    np.testing.assert_allclose(near.least(clouds), exact, atol=2e-7)
    # what was looked at before does not matter
    np.testing.assert_array_equal(near.least(clouds[2:]), NearObject(thing).least(clouds)[2:])


def test_points_that_may_meet_an_object_are_all_those_that_do() -> None:
    thing = glass().placed((0.2, 0.1, -0.3), (0.1, 0.2, 0.3, 0.9))
    points, way = thing.place.apply(cloud(thing, 400))[0], np.array([0.48, -0.6, 0.64])
    near = NearObject(thing)
    met = near.met(points, way, 1e-3)
    path = points[:, None] + np.linspace(0.0, 0.5, 60)[:, None] * way
    low, high = thing.vertices.min(axis=0) - 1e-3, thing.vertices.max(axis=0) + 1e-3
    local = thing.place.to_local(path.reshape(-1, 3))[0]
    passes = ((local >= low) & (local <= high)).all(axis=1).reshape(path.shape[:2]).any(axis=1)
    assert met[passes].all()
    assert 50 < np.count_nonzero(~met) < 350
    # along a side of the box, outside it and inside
    still = near.met(
        thing.place.apply([[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])[0],
        thing.place.apply([[0, 1, 0]])[0, 0] - thing.place.position[0],
        0.0,
    )
    assert still.tolist() == [False, True]


def test_each_part_has_its_own() -> None:
    import warp as wp

    thing, parts = ball(0.05, subdivisions=2), np.repeat(np.arange(3, dtype=np.int32), 40)
    points = np.random.default_rng(2).uniform(-0.05, 0.05, size=(2, 120, 3)).astype(np.float32)
    gaps = np.full((2, 4), np.inf)
    gaps[:, 2] = -1.0  # known already to be deeper
    NearObject(thing).least_by_part(
        wp.array(points, dtype=wp.vec3, device="cpu"), np.arange(120, dtype=np.int32), parts, gaps
    )
    each = ObjectSet(thing).distances(points, which=[0, 0]).distance.reshape(2, 3, 40).min(axis=2)
    np.testing.assert_allclose(gaps[:, :2], each[:, :2], atol=1e-8)
    assert (gaps[:, 2] == -1.0).all()
    assert np.isinf(gaps[:, 3]).all()


def test_a_flat_side_is_as_far_as_its_plane() -> None:
    """Of two triangles beside an edge the nearer one is found, though rounding a point to float32 moves it by more."""
    thing, rng, count = cylinder(0.054, 0.108), np.random.default_rng(0), 20_000
    top = float(np.float32(thing.vertices[:, 1].max()))
    points = rng.uniform(-0.018, 0.018, size=(count, 3))
    points[:, 1] = top + rng.uniform(1e-4, 5e-4, size=count)
    found = NearObject(thing).near(points, 1e-3).distance
    np.testing.assert_allclose(found, points[:, 1] - top, rtol=0, atol=5e-11)  # rounding of 0.5 mm to float32
