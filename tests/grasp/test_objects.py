"""Objects: built-in shapes, files, and what is found and mended on the way in."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.grasp import GraspObject, ObjectSet, Places, load_object, make_object
from warpjld.grasp.shapes import SHAPES, ball, box, cylinder, glass, plate

CUBE = trimesh.creation.box((1.0, 1.0, 1.0))


@pytest.mark.parametrize("make", SHAPES.values(), ids=SHAPES)
def test_built_in_shapes_are_closed_look_outwards_and_stand_in_the_middle(make) -> None:
    thing = make()
    assert thing.report.solid
    assert thing.report.notes() == []
    assert thing.volume > 0
    np.testing.assert_allclose(thing.vertices.max(axis=0), -thing.vertices.min(axis=0), rtol=2e-3)


def test_volumes_tend_to_those_of_the_exact_shapes() -> None:
    sizes = [ball(0.06, subdivisions=k).volume for k in (2, 3, 4)]
    errors = 1 - np.array(sizes) / (np.pi * 0.06**3 / 6)
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4, rtol=0.05)  # second order
    assert box(0.1, 0.2, 0.3).volume == pytest.approx(0.006, rel=1e-12)
    assert cylinder(0.06, 0.1, segments=256).volume == pytest.approx(np.pi * 0.03**2 * 0.1, rel=2e-4)
    assert glass().volume < 0.3 * cylinder(0.07, 0.12).volume
    assert plate().centroid[1] < 0  # its foot is below, its rim above the middle


@pytest.mark.parametrize(
    ("name", "file", "size"),
    [
        ("mug", "mujoco_mug/mug.obj", 0.123),
        ("can", "robosuite_can_lemon_bread/can.stl", 0.08),
        ("bottle", "ycb_mustard_bottle/ycb_mustard_bottle.glb", 0.191),
        ("pepper", "bell_pepper/bell_pepper.glb", 0.081),
    ],
)
def test_files_in_their_own_units(data: Path, name: str, file: str, size: float) -> None:
    thing = load_object(data / file, name=name, unit="cm" if name == "mug" else "m")
    assert thing.size.max() == pytest.approx(size, abs=1e-3)
    assert thing.volume > 0
    told = " ".join(thing.report.notes())
    assert ("not watertight: 8 open edges" in told) == (name == "can")
    assert ("2 duplicate triangles" in told) == (name == "bottle")


def test_units_axes_scale_and_centre(tmp_path: Path) -> None:
    tall = trimesh.creation.box((1.0, 2.0, 3.0))
    tall.apply_translation((5.0, 5.0, 5.0))
    tall.export(tmp_path / "tall.stl")
    thing = load_object(tmp_path / "tall.stl", unit="mm", up="z", scale=2.0, centre=True)
    np.testing.assert_allclose(thing.size, [0.002, 0.006, 0.004], rtol=1e-6)
    np.testing.assert_allclose(thing.centroid, 0, atol=1e-9)
    assert thing.volume > 0  # turned, not mirrored


def test_inverted_and_mixed_triangles_are_turned() -> None:
    inside_out = make_object("a", CUBE.vertices, CUBE.faces[:, ::-1])
    assert inside_out.volume == pytest.approx(1)
    assert inside_out.report.flipped == 12
    mixed = CUBE.faces.copy()
    mixed[[1, 5, 7]] = mixed[[1, 5, 7], ::-1]
    thing = make_object("b", CUBE.vertices, mixed)
    assert thing.volume == pytest.approx(1)
    assert thing.report.flipped == 3


def test_a_cavity_stays_a_cavity() -> None:
    vertices = np.concatenate([CUBE.vertices, CUBE.vertices / 2])
    hollow = np.concatenate([CUBE.faces, CUBE.faces[:, ::-1] + 8])
    for faces in (hollow, hollow[:, ::-1]):
        thing = make_object("hollow", vertices, faces)
        assert thing.volume == pytest.approx(7 / 8)
        assert thing.report.solid


def test_waste_is_taken_out_and_told() -> None:
    faces = np.concatenate([CUBE.faces, CUBE.faces[:2], [[0, 0, 1]], [[0, 1, 8]]])
    vertices = np.concatenate([CUBE.vertices, [(CUBE.vertices[0] + CUBE.vertices[1]) / 2]])
    report = make_object("a", vertices, faces).report
    assert (report.degenerate, report.duplicates) == (1, 2)
    assert report.solid


def stacked(*, lids: int, turned: slice = slice(0)) -> GraspObject:
    """Two cubes of 1 m³, one on the other, in one mesh that has the ring between them once, and so many of their two
    lids there, cut along different diagonals; some triangles turned round."""
    ring = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    levels = np.concatenate([np.insert(ring, 1, y, axis=1) for y in range(3)]).astype(float)
    bottom, top = [(0, 1, 2), (0, 2, 3)], [(8, 10, 9), (8, 11, 10)]
    between = [(5, 7, 6), (5, 4, 7), (4, 5, 6), (4, 6, 7)][: 2 * lids]
    sides = [
        t
        for k in (0, 4)
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))
        for t in ((k + a, k + 4 + a, k + 4 + b), (k + a, k + 4 + b, k + b))
    ]
    faces = np.array(bottom + sides + top + between)
    faces[turned] = faces[turned, ::-1]
    return make_object("stack", levels, faces)


@pytest.mark.parametrize("turned", [slice(0), slice(2, 10), slice(20, 22), slice(10, 20)])
def test_closed_pieces_that_share_a_ring_are_told_apart(turned: slice) -> None:
    thing = stacked(lids=2, turned=turned)
    assert thing.volume == pytest.approx(2.0)
    assert (thing.report.components, thing.report.open_edges, thing.report.non_manifold) == (2, 0, 4)
    assert not thing.report.solid
    assert "4 edges belong to more than two triangles" in "; ".join(thing.report.notes())
    points = np.random.default_rng(0).uniform(-0.5, 2.5, size=(200, 3))
    inside = np.all((points > 0.0) & (points < [1.0, 2.0, 1.0]), axis=1)
    assert np.array_equal(ObjectSet(thing).distances(points).distance[0] < 0.0, inside)


def test_a_wall_inside_leaves_open_edges() -> None:
    thing = stacked(lids=1)
    assert (thing.report.components, thing.report.open_edges, thing.report.non_manifold) == (2, 4, 4)
    assert thing.volume == pytest.approx(2.0)
    notes = "; ".join(thing.report.notes())
    assert "4 open edges" in notes
    assert "more than two triangles" in notes


def test_three_sheets_on_an_edge_are_told() -> None:
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0.0]])
    report = make_object("sheets", vertices, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])).report
    assert report.non_manifold == 1
    assert not report.solid


def test_overlapping_pieces_are_told() -> None:
    vertices = np.concatenate([CUBE.vertices, CUBE.vertices + 0.5])
    thing = make_object("two", vertices, np.concatenate([CUBE.faces, CUBE.faces + 8]))
    assert thing.report.crossing > 0
    assert not thing.report.solid
    assert "intersect others" in thing.report.notes()[0]


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), r"object x: vertices: want shape \(n, 3\)"),
        (np.zeros((4, 3)), np.array([[0, 1, 2]]), "is empty"),
        (np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]), "is empty"),
        (np.array([[0, 0, np.nan], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]]), "vertex 0 is not finite"),
        (CUBE.vertices, np.array([[0, 1, 99]]), "indices must lie in 0…7"),
    ],
    ids=["nothing", "one place", "a line", "nan", "index"],
)
def test_what_cannot_be_used_is_refused(vertices, faces, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make_object("x", vertices, faces)


def test_a_moebius_strip_has_no_inside() -> None:
    n = 24
    turn = 2 * np.pi * np.arange(n) / n
    points = []
    for side in (-0.2, 0.2):
        r = 1 + side * np.cos(turn / 2)
        points.append(np.stack([r * np.cos(turn), r * np.sin(turn), side * np.sin(turn / 2)], axis=1))
    k = np.arange(n)
    after = np.r_[k[1:], n]  # the end of one border is the start of the other
    other = np.r_[k[1:] + n, 0]
    faces = np.concatenate([np.stack([k, after, k + n], 1), np.stack([after, other, k + n], 1)])
    with pytest.raises(InputError, match="one side only"):
        make_object("x", np.concatenate(points), faces)


@pytest.mark.parametrize(
    "call",
    [
        lambda: ball(0.0),
        lambda: ball(np.nan),
        lambda: ball(subdivisions=9),
        lambda: glass(thickness=0.05),
        lambda: cylinder(segments=2),
        lambda: ball().scaled(-1),
        lambda: ball().check_facet(5120),
        lambda: Places.of(rotation=(0, 0, 0, 0)),
        lambda: Places.of((np.nan, 0, 0)),
        lambda: Places.of(np.zeros((2, 3)), np.ones((3, 4))),
    ],
)
def test_wrong_sizes_are_refused(call) -> None:
    with pytest.raises(InputError):
        call()


def test_wrong_files(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    for path, options, says in (
        ("b.obj", {}, "No such file"),
        ("a.obj", {}, "no triangles"),
        ("a.obj", {"unit": "feet"}, "want one of"),
        ("a.obj", {"up": "w"}, "want x, y or z"),
    ):
        with pytest.raises(InputError, match=says):
            load_object(tmp_path / path, **options)


def test_places_go_there_and_back() -> None:
    places = Places.of([[1, 2, 3.0]], [[0, 0.6, 0, 0.8]])
    points = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(places.to_local(places.apply(points)[0])[0], points, atol=1e-12)
