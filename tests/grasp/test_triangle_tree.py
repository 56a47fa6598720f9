"""The tree that finds nearest triangles: what it holds, and what it finds where meshes are at their worst."""

import numpy as np
import pytest

from tests.grasp.oracle import signed_distance
from warpjld.grasp import ObjectSet, make_object
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.shapes import ball
from warpjld.grasp.triangle_tree import build_tree, join_trees
from warpjld.grasp.validation import MeshReport


@pytest.mark.parametrize("count", [1, 7, 8, 9, 64, 65, 513, 1281])
def test_every_triangle_is_in_one_leaf_and_in_every_box_above(count: int) -> None:
    rng = np.random.default_rng(count)
    vertices = rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3))
    tree = build_tree(vertices.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3))
    assert sorted(set(tree.face.ravel().tolist())) == list(range(count))
    seen: list[int] = []

    def descend(node: int, low: np.ndarray, high: np.ndarray) -> None:
        for lane in range(8):
            below, above = tree.boxes[node, 0, :, lane], tree.boxes[node, 1, :, lane]
            if below[0] > 1e17:
                continue
            assert (below >= low).all()
            assert (above <= high).all()
            first = tree.child[node]
            if first >= 0:
                descend(first + lane, below, above)
                continue
            leaf = -1 - first + lane
            seen.extend(tree.face[leaf].tolist())
            corners = vertices[tree.face[leaf]].astype(np.float32)
            np.testing.assert_array_equal(tree.corners[leaf], corners.transpose(1, 2, 0))
            assert (corners >= below).all()
            assert (corners <= above).all()

    everywhere = np.full(3, np.inf)
    descend(int(tree.root[0]), -everywhere, everywhere)
    assert sorted(set(seen)) == list(range(count))


def test_boxes_hug_what_they_hold() -> None:
    thing = ball(0.1, subdivisions=5)
    tree = build_tree(thing.vertices, thing.faces)
    last = tree.boxes[tree.child < 0]
    held = np.linalg.norm(last[:, 1] - last[:, 0], axis=1)[last[:, 0, 0] < 1e17]
    edge = np.linalg.norm(thing.vertices[thing.faces[:, 0]] - thing.vertices[thing.faces[:, 1]], axis=1).mean()
    assert len(tree.face) <= len(thing.faces) / 8 + 1
    assert np.median(held) < 5 * edge  # eight triangles in a compact patch


def test_joined_trees_are_the_trees() -> None:
    one, two = (build_tree(b.vertices, b.faces) for b in (ball(0.1, subdivisions=2), ball(0.2, subdivisions=3)))
    both = join_trees([one, two])
    assert both.root.tolist() == [0, len(one.child)]
    second = both.child[len(one.child) :]
    np.testing.assert_array_equal(np.where(second < 0, second + len(one.face), second - len(one.child)), two.child)
    np.testing.assert_array_equal(both.face[len(one.face) :], two.face)


def test_triangles_without_area_count_as_their_edges() -> None:
    """Deformed skins hold such triangles; their plane is nowhere."""
    rng = np.random.default_rng(0)
    vertices = np.array([[0, 0, 0], [0.01, 0, 0], [0.03, 0, 0], [0, 0.01, 0], [0.02, 0.03, 0.01], [0.1, 0.2, 0.3]])
    vertices = np.concatenate([vertices, vertices[4:5] + (vertices[5] - vertices[4]) * 0.3, vertices[:1]])
    faces = np.array([[0, 1, 2], [0, 7, 3], [4, 6, 5], [2, 2, 2]], dtype=np.int32)
    thing = GraspObject("slivers", vertices, faces, MeshReport(open_edges=1, solid=False))
    points = (rng.normal(size=(200, 3)) * 0.2).astype(np.float32).astype(np.float64)
    segments = [(0, 2), (0, 3), (4, 5)]
    expected = np.min([_to_segment(points, vertices[a], vertices[b]) for a, b in segments], axis=0)
    np.testing.assert_allclose(np.abs(ObjectSet(thing).distances(points).distance[0]), expected, rtol=0, atol=1e-6)


def test_far_away_and_in_a_corner_of_the_world() -> None:
    """Points of 20 m in a frame in which the object lies 5 m from the origin."""
    thing = ball(0.1, subdivisions=3)
    there = make_object("there", thing.vertices + np.array([5.0, -3.0, 0.0]), thing.faces)
    points = (np.random.default_rng(1).normal(size=(300, 3)) * 10.0).astype(np.float32).astype(np.float64)
    found = ObjectSet(there).distances(points).distance[0]
    np.testing.assert_allclose(found, signed_distance(points, there), rtol=1e-7, atol=5e-7)


def _to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
