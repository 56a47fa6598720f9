"""Crossing faces: against hand-made cases, and against an independent test of every pair."""

from __future__ import annotations

import time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.covering import Covering
from warpjld.covering.intersections import Crossings, Parts, crossing_faces, surface_parts

FLAT = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
TWO = np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)


def pairs_of(second: list[list[float]]) -> int:
    return len(crossing_faces(np.array(FLAT + second), TWO).pairs)


@pytest.mark.parametrize(
    ("second", "cross"),
    [
        ([[0.2, 0.2, -1], [0.3, 0.2, 1], [0.2, 0.3, 1]], True),
        ([[0.2, 0.2, -1], [5, 5, 1], [5, 6, 1]], False),
        ([[-1, 0.2, -1], [2, 0.2, -1], [0.3, 0.2, 1]], True),
        ([[0.2, 0.2, 0], [0.3, 0.2, 1], [0.2, 0.3, 1]], False),
        ([[0.2, 0.2, 0], [0.6, 0.2, 0], [0.2, 0.3, 0]], False),
        ([[0.2, 0.2, 1e-9], [0.3, 0.2, 1], [0.2, 0.3, 1]], False),
        ([[0.2, 0.2, -1e-9], [0.3, 0.2, 1], [0.2, 0.3, 1]], True),
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1]], False),
        ([[0.5, 0, -1], [0.5, 0, 1], [0.5, -1, 0]], True),
    ],
    ids=["pierced", "aside", "cut", "corner touches", "coplanar", "above", "below", "parallel", "edges cross"],
)
def test_two_faces(second: list[list[float]], cross: bool) -> None:
    assert pairs_of(second) == int(cross)


def test_faces_with_a_common_corner_cross_by_the_edge_opposite_to_it() -> None:
    points = np.array([*FLAT, [0.3, 0.2, -1.0], [0.2, 0.3, 1.0], [0.3, 0.2, 1.0]])
    assert len(crossing_faces(points, np.array([[0, 1, 2], [0, 3, 4]], dtype=np.int32)).pairs) == 1
    assert len(crossing_faces(points, np.array([[0, 1, 2], [5, 4, 0]], dtype=np.int32)).pairs) == 0


def test_neighbours_never_cross() -> None:
    points = np.array([*FLAT, [0.1, 0.1, 0.0]])
    folded_flat = np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int32)
    assert not len(crossing_faces(points, folded_flat).pairs)


def test_a_sphere_pushed_into_itself() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = np.array(sphere.vertices), np.array(sphere.faces, dtype=np.int32)
    assert not len(crossing_faces(vertices, faces).pairs)
    assert not len(crossing_faces(vertices * [1.0, 1.0, 0.01], faces).pairs), "flat, not through itself"
    pushed = vertices.copy()
    cap = pushed[:, 2] > 0.8
    pushed[cap, 2] -= 2.5
    found = crossing_faces(pushed, faces)
    assert len(found.pairs)
    heights = pushed[faces[found.faces]][..., 2]
    assert (heights.min(axis=1) < -0.5).all(), "all where the cap leaves through the other side"


def overlap_brute_force(vertices: np.ndarray, faces: np.ndarray) -> set[tuple[int, int]]:
    """Every pair without a common corner, each edge intersected with the other's plane by solving 3 × 3 equations."""
    found = set()
    for i in range(len(faces)):
        for j in range(i + 1, len(faces)):
            if set(faces[i]) & set(faces[j]):
                continue
            for e, f in ((i, j), (j, i)):
                a, b, c = vertices[faces[f]]
                for k in range(3):
                    p, q = vertices[faces[e][k]], vertices[faces[e][(k + 1) % 3]]
                    matrix = np.column_stack([b - a, c - a, p - q])
                    if abs(np.linalg.det(matrix)) < 1e-14:
                        continue
                    u, v, t = np.linalg.solve(matrix, p - a)
                    if u >= 0 and v >= 0 and u + v <= 1 and 0 < t < 1:
                        found.add((i, j))
    return found


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_random_soups_agree_with_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(30, 3))
    faces = np.arange(30, dtype=np.int32).reshape(10, 3)
    got = {tuple(p) for p in crossing_faces(vertices, faces).pairs.tolist()}
    assert got == overlap_brute_force(vertices, faces)


def test_twenty_thousand_faces_take_about_a_second() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5)
    vertices, faces = np.array(sphere.vertices), np.array(sphere.faces, dtype=np.int32)
    pushed = np.where(vertices[:, 2:] > 0.8, vertices - [0.0, 0.0, 2.2], vertices)
    crossing_faces(pushed, faces)  # compiles
    started = time.perf_counter()
    found = crossing_faces(pushed, faces)
    assert len(faces) == 20_480
    assert len(found.pairs)
    assert time.perf_counter() - started < 5.0, "0.3 s on an idle machine; a busy one gets time"


def test_crossings_are_told_apart_by_part() -> None:
    parts = Parts(("left.index", "left.palm"), np.array([0, 0, 1], dtype=np.int32))
    crossings = Crossings(np.array([[0, 1], [0, 2]], dtype=np.int32))
    assert crossings.contact(parts).pairs.tolist() == [[0, 2]]
    assert crossings.folds(parts).pairs.tolist() == [[0, 1]]
    assert crossings.summary(parts) == {"left.index": 2, "left.index × left.palm": 2}


def test_parts_of_a_hand(bound: Covering) -> None:
    parts = surface_parts(bound)
    digits = {f"left.{d}" for d in ("thumb", "index", "middle", "ring", "pinky")}
    assert digits | {"left.palm"} <= set(parts.names)
    tip = bound.skeleton.rest[bound.skeleton.index("middle.tip")]
    centres = bound.surface.vertices[bound.surface.faces].mean(axis=1)
    nearest = np.linalg.norm(centres - tip, axis=1).argmin()
    assert parts.names[parts.of_face[nearest]] == "left.middle"
