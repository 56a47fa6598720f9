"""Parts of one skin that overlap are found, and shown lying on each other; neighbours are left alone."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.covering.kept import bind_kept
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.rig import Rig
from warpjld.simulation.bodies.skin_parts import SkinParts, skin_parts
from warpjld.simulation.display.overlap import SurfacePart, self_overlaps
from warpjld.simulation.display.separate import VisibleSurface, separate_surfaces
from warpjld.skeleton import poses_from_angles

RADIUS, OVERLAP = 0.01, 6e-4
BALL = trimesh.creation.icosphere(4, RADIUS)


def two_balls() -> tuple[np.ndarray, SkinParts]:
    """One skin in two pieces that overlap along x."""
    x = np.asarray(BALL.vertices)
    faces = np.asarray(BALL.faces, np.int32)
    vertices = np.concatenate([x, x + np.array([2.0 * RADIUS - OVERLAP, 0.0, 0.0])])
    labels = np.repeat([0, 1], len(x)).astype(np.int32)
    both = np.concatenate([faces, faces + len(x)])
    return vertices, SkinParts(labels, np.eye(2, dtype=bool), np.array([0, 1], np.int32), ("index", "thumb"), both)


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return np.asarray(trimesh.Trimesh(vertices, faces, process=False).vertex_normals)


def test_both_move_half_the_way() -> None:
    vertices, parts = two_balls()
    found = self_overlaps(parts, vertices, normals(vertices, parts.faces))
    assert set(found) == {("index", "thumb"), ("thumb", "index")}
    for one in found.values():
        assert one.depth == pytest.approx(OVERLAP, rel=0.05)
    cleared = separate_surfaces({"hand": VisibleSurface(vertices, parts.faces, 8e4, 1e-3, parts)}, {}, 0.0)
    at = cleared.vertices["hand"]
    moved = np.linalg.norm(at - vertices, axis=1)
    half = len(vertices) // 2
    assert moved[:half].max() == pytest.approx(0.5 * OVERLAP, rel=0.1)
    assert moved[half:].max() == pytest.approx(0.5 * OVERLAP, rel=0.1)
    assert cleared.left.get((SurfacePart("hand", "index"), SurfacePart("hand", "thumb")), 0.0) < 1e-9
    pieces = [Facets(at[:half], parts.faces[: len(BALL.faces)]), Facets(at[half:], parts.faces[: len(BALL.faces)])]
    assert pieces[0].project(at[half:]).distance.min() > -1e-6
    assert pieces[1].project(at[:half]).distance.min() > -1e-6


def test_what_contact_does_not_know_of_stays_and_is_said() -> None:
    vertices, parts = two_balls()
    nobody = np.zeros(len(vertices), dtype=bool)
    cleared = separate_surfaces({"hand": VisibleSurface(vertices, parts.faces, 8e4, 1e-3, parts, nobody)}, {}, 0.0)
    np.testing.assert_array_equal(cleared.vertices["hand"], vertices)
    assert cleared.left[SurfacePart("hand", "index"), SurfacePart("hand", "thumb")] == pytest.approx(OVERLAP, rel=0.05)


def test_neighbours_never_meet() -> None:
    vertices, parts = two_balls()
    beside = SkinParts(parts.labels, np.ones((2, 2), dtype=bool), parts.part_of, parts.names, parts.faces)
    assert self_overlaps(beside, vertices, normals(vertices, parts.faces)) == {}


def test_parts_of_one_ball_are_closed_where_they_part() -> None:
    x, faces = np.asarray(BALL.vertices), np.asarray(BALL.faces, np.int32)
    labels = (x[:, 2] > 0.3 * RADIUS).astype(np.int32)
    parts = SkinParts(labels, np.eye(2, dtype=bool), np.array([1, 0], np.int32), ("index", "palm"), faces)
    volumes = []
    for part in parts.parts:
        assert len(part.loops) == 1
        closed = part.surface(x)
        solid = trimesh.Trimesh(closed.vertices, closed.faces, process=False)
        assert solid.is_watertight
        volumes.append(solid.volume)
    assert sum(volumes) == pytest.approx(BALL.volume, rel=1e-9)
    assert self_overlaps(parts, x, np.asarray(BALL.vertex_normals)) == {}


def test_a_hand_overlaps_itself_where_digits_cross(rig: Rig, hand: FleshHand) -> None:
    covering, _ = bind_kept(rig)
    angles = np.zeros((len(rig.skeleton), 4))
    rest = covering.deform(poses_from_angles(rig.skeleton, angles[None]))[0].astype(np.float64)
    parts = skin_parts(hand)
    assert {part.name for part in parts.parts} == {"thumb", "index", "middle", "ring", "pinky", "palm"}
    assert self_overlaps(parts, rest, normals(rest, parts.faces)) == {}
    for knuckle, degrees in (("base", 90.0), ("knuckle2", 100.0), ("knuckle3", 60.0)):
        angles[rig.skeleton.index(f"left.index.{knuckle}"), 0] = np.radians(degrees)
    bent = covering.deform(poses_from_angles(rig.skeleton, angles[None]))[0].astype(np.float64)
    found = self_overlaps(parts, bent, normals(bent, parts.faces))
    assert {frozenset(two) for two in found} >= {frozenset({"index", "palm"})}
    assert max(one.depth for one in found.values()) > 2e-3
