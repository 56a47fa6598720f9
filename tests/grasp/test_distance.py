"""Signed distances against brute force in float64, signs included."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.grasp.oracle import signed_distance
from warpjld.errors import InputError
from warpjld.grasp import ObjectSet, Places, facet_distance, load_object, make_object
from warpjld.grasp.shapes import SHAPES, ball, box

EXACT = 1e-6  # metres: asked for; float32 coordinates of a body's size give about 2e-7

MESHES = [
    "bell_pepper/bell_pepper.glb",
    "body_anny/body_104joints.glb",  # four shells, which overlap
    "body_anny/body_lowpoly_163joints.glb",  # passes through itself
    "godot_teacup/teacup.glb",
    "hand_anny/left.glb",  # open at the wrist
    "hand_webxr_generic/right.glb",
    "mujoco_mug/mug.obj",
    "robosuite_can_lemon_bread/bread.obj",
    "robosuite_can_lemon_bread/can.stl",  # open edges
    "ycb_mustard_bottle/ycb_mustard_bottle.glb",
]


def samples(thing, count: int, seed: int = 0) -> np.ndarray:
    """Near the surface, in and around the bounding box, and far away; exact in float32."""
    rng = np.random.default_rng(seed)
    face = rng.integers(len(thing.faces), size=count)
    on = np.einsum("nk,nki->ni", rng.dirichlet([1, 1, 1], size=count), thing.vertices[thing.faces[face]])
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    size = np.linalg.norm(high - low)
    near = on + rng.normal(size=(count, 3)) * size * 0.01
    around = rng.uniform(low - 0.2 * size, high + 0.2 * size, size=(count, 3))
    far = rng.normal(size=(count // 10, 3)) * 3 * size
    return np.concatenate([near, around, far]).astype(np.float32).astype(np.float64)


def assert_exact(thing, points) -> None:
    found = ObjectSet(thing).distances(points, places=Places.of()).distance[0]
    np.testing.assert_allclose(found, signed_distance(points, thing), rtol=0, atol=EXACT)


@pytest.mark.parametrize("make", SHAPES.values(), ids=SHAPES)
def test_built_in_shapes(make) -> None:
    assert_exact(make(), samples(make(), 40))


@pytest.mark.parametrize(
    "file", [pytest.param(file, marks=pytest.mark.slow if file.startswith("body_") else ()) for file in MESHES]
)
def test_real_meshes(data: Path, file: str) -> None:
    thing = load_object(data / file, unit="cm" if "mug" in file else "m")
    assert_exact(thing, samples(thing, max(20, 300_000 // len(thing.faces)) if len(thing.faces) > 3000 else 100))


@pytest.mark.slow
@pytest.mark.parametrize("file", MESHES)
def test_real_meshes_at_many_points(data: Path, file: str) -> None:
    thing = load_object(data / file, unit="cm" if "mug" in file else "m")
    assert_exact(thing, samples(thing, 2500, seed=1))


@pytest.mark.parametrize("cut", [0.02, -0.02])
def test_open_ball(cut: float) -> None:
    whole = ball(0.1, subdivisions=3)
    faces = whole.faces[whole.vertices[whole.faces][:, :, 1].mean(axis=1) < cut]
    thing = make_object("open", whole.vertices, faces)
    assert not thing.report.watertight
    assert_exact(thing, samples(thing, 200))


def test_ball_against_the_formula() -> None:
    points = np.random.default_rng(0).normal(size=(2000, 3)) * 0.05
    found = ObjectSet(ball(0.1, subdivisions=6)).distances(points).distance[0]
    np.testing.assert_allclose(found, np.linalg.norm(points, axis=1) - 0.05, atol=2.5e-5)  # the facets' sagitta


def test_rows_take_sets_objects_and_places_and_equal_single_queries_bit_for_bit() -> None:
    rng = np.random.default_rng(3)
    things = ObjectSet([ball(0.06), box(), SHAPES["plate"]()])
    points = (rng.normal(size=(4, 300, 3)) * 0.05).astype(np.float32)
    places = Places.of(rng.normal(size=(12, 3)) * 0.02, rng.normal(size=(12, 4)))
    which, sets = np.repeat([0, 1, 2], 4), np.tile(np.arange(4), 3)
    together = things.distances(points, which=which, places=places, sets=sets, nearest=True, threads=2)
    assert together.distance.shape == (12, 300)
    for row in range(12):
        for k in range(0, 300, 37):
            alone = things.distances(points[sets[row], k : k + 1], which=which[row], places=places[row], nearest=True)
            assert alone.distance[0, 0] == together.distance[row, k]
            assert alone.face[0, 0] == together.face[row, k]
            np.testing.assert_array_equal(alone.point[0, 0], together.point[row, k])
    away = np.linalg.norm(points[sets] - together.point, axis=-1)
    np.testing.assert_allclose(np.abs(together.distance), away, atol=1e-7)


def test_limit_leaves_far_points_out_and_changes_nothing_near() -> None:
    things, points = ObjectSet(box()), samples(box(), 400)
    everything, near = things.distances(points).distance, things.distances(points, limit=0.005)
    close = np.abs(everything) < 0.005
    assert 0 < close.sum() < close.size
    np.testing.assert_array_equal(near.distance[close], everything[close])
    assert np.isinf(near.distance[~close]).all()
    assert (near.face[~close] == -1).all()


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.floats(-0.2, 0.2)] * 3), st.tuples(*[st.floats(-1, 1)] * 4), st.integers(0, 2999))
def test_a_facet_basis_moves_with_its_object(shift, turn, facet) -> None:
    if np.linalg.norm(turn) < 0.1:
        return
    thing, points = box(), np.random.default_rng(1).normal(size=(20, 3))
    place = Places.of(shift, turn)
    here = facet_distance(points, thing, facet)
    there = facet_distance(place.apply(points)[0], thing, facet, place)
    np.testing.assert_allclose(there.coordinates, here.coordinates, atol=1e-12)


def test_facet_coordinates_and_the_in_facet_test() -> None:
    thing = make_object(
        "a", [[0, 0, 0], [2, 0, 0], [0, 0, -2], [0, -1, 0.0]], [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
    )
    facet = int(np.argmax(thing.normals[:, 1]))
    assert thing.normals[facet, 1] == pytest.approx(1)
    found = facet_distance([[0.5, 0.3, -0.5], [0.5, -0.3, -0.5], [1.5, 0.3, -1.5], [-0.1, 0, 0]], thing, facet)
    np.testing.assert_allclose(found.distance, [0.3, -0.3, 0.3, 0])
    assert found.inside.tolist() == [True, True, False, False]
    np.testing.assert_allclose(np.abs(found.coordinates[0, [0, 2]]).sum(), 1)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.distances([[0, 0, np.nan]]), r"entry \[0, 2\] is not finite"),
        (lambda s: s.distances([[0, 0]]), "want shape"),
        (lambda s: s.distances(np.zeros((2, 3)), which=1), "from 0 to 0"),
        (lambda s: s.distances(np.zeros((2, 3)), limit=0), "limit"),
        (lambda s: s.distances(np.zeros((2, 3, 3)), places=Places.of(np.zeros((3, 3)))), "rows"),
        (lambda s: s.distances(np.zeros((2, 3)), sets=[1]), "sets"),
        (lambda s: facet_distance(np.zeros((2, 3)), s.objects[0], 99999), "facets 0 to"),
        (lambda s: facet_distance(np.zeros((2, 3)), s.objects[0], -1), "facets 0 to"),
        (lambda s: ObjectSet([]), "at least one"),
    ],
)
def test_wrong_input(call, says: str) -> None:
    with pytest.raises(InputError, match=says):
        call(ObjectSet(ball()))
