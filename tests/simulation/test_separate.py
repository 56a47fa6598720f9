"""Visible surfaces that overlap by a fraction of an element are shown lying on each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.fem.contact.bodies import lid
from warpjld.fem import Body, LinearElastic, ball_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.mesh.embedding import embed
from warpjld.simulation.bodies.surface_offset import face_offsets, node_offsets
from warpjld.simulation.display.overlap import SurfacePart
from warpjld.simulation.display.separate import VisibleSurface, separate_surfaces

RADIUS = 0.01


def sphere(at: float, modulus: float, most: float = 1e-3) -> VisibleSurface:
    mesh = trimesh.creation.icosphere(4, RADIUS)
    return VisibleSurface(
        np.asarray(mesh.vertices) + np.array([at, 0.0, 0.0]), np.asarray(mesh.faces, np.int32), modulus, most
    )


def depth(one: VisibleSurface, at: np.ndarray, other: VisibleSurface, there: np.ndarray) -> float:
    """Of each in the other."""
    mine, theirs = Facets(at, one.faces).project(there).distance, Facets(there, other.faces).project(at).distance
    return -float(min(mine.min(), theirs.min()))


@pytest.mark.parametrize(("moduli", "share"), [((1e5, 1e5), 0.5), ((1e5, 4e5), 0.8), ((4e5, 1e5), 0.2)])
def test_two_spheres_are_flattened_the_softer_one_more(moduli: tuple[float, float], share: float) -> None:
    one, other = sphere(0.0, moduli[0]), sphere(2.0 * RADIUS - 4e-4, moduli[1])
    assert depth(one, one.vertices, other, other.vertices) > 3.9e-4
    found = separate_surfaces({"one": one, "other": other}, {}, 0.0)
    at, there = found.vertices["one"], found.vertices["other"]
    assert depth(one, at, other, there) < 2e-6
    assert found.left[SurfacePart("one"), SurfacePart("other")] < 2e-6
    assert found.moved["one"] == pytest.approx(share * 4e-4, rel=0.15)
    assert found.moved["other"] == pytest.approx((1.0 - share) * 4e-4, rel=0.15)
    far = one.vertices[:, 0] < 0.9 * RADIUS
    np.testing.assert_array_equal(at[far], one.vertices[far])


def test_what_no_element_explains_stays_and_is_said() -> None:
    one, other = sphere(0.0, 1e5, 2e-4), sphere(2.0 * RADIUS - 2e-3, 1e5, 2e-4)
    found = separate_surfaces({"one": one, "other": other}, {}, 0.0)
    assert max(found.moved.values()) <= 2e-4 * (1.0 + 1e-9)
    assert found.left[SurfacePart("one"), SurfacePart("other")] == pytest.approx(2e-3 - 2 * 2e-4, rel=0.1)


def test_obstacles_do_not_give_way() -> None:
    plate = Plane((0.0, 0.0, -RADIUS), (0, 0, 1), motion=lambda time: ((0, 0, time), (0, 0, 0, 1)))
    found = separate_surfaces({"one": sphere(0.0, 1e5)}, {"plate": plate}, 3e-4)
    assert found.vertices["one"][:, 2].min() == pytest.approx(3e-4 - RADIUS, abs=1e-12)
    assert found.left == {(SurfacePart("one"), SurfacePart("plate")): 0.0}


def test_nothing_that_is_apart_moves() -> None:
    one, other = sphere(0.0, 1e5), sphere(2.0 * RADIUS + 1e-5, 1e5)
    found = separate_surfaces({"one": one, "other": other}, {}, 0.0)
    np.testing.assert_array_equal(found.vertices["one"], one.vertices)
    assert found.moved == {"one": 0.0, "other": 0.0}


def test_a_visible_ball_lies_on_the_plate_its_coarse_elements_are_pressed_on() -> None:
    """Elements of a third of the radius: their faces lie 2 % of it within the ball, and contact has to be with it."""
    mesh = ball_hexes(1.0, n=4)
    visible = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    height = face_offsets(mesh, "outer", vertices, faces)
    outer = np.unique(mesh.quads(mesh.face_set("outer")))
    assert (height[outer] > 0.005).all()
    assert (height[outer] < 0.06).all()
    assert not np.delete(height, outer).any()
    held = prescribe(mesh, np.flatnonzero(mesh.nodes[:, 2] < -0.5), x=0, y=0, z=0)
    embedding = embed(mesh, vertices, reach=1.0)
    worst = {}
    for offset in (None, height):
        pair = Pair("outer", lid(0.2, height=1.0), offset=offset)
        moved = press(Body(mesh, LinearElastic(1.0, 0.3)), held, [pair]).last.displacement
        worst[offset is None] = float((vertices + embedding.carry(moved))[:, 2].max()) - 0.8
    assert worst[False] < 0.7 * worst[True]
    shown = VisibleSurface(vertices + embedding.carry(moved), faces, 1.0, 0.15)
    found = separate_surfaces({"ball": shown}, {"lid": lid(0.2, height=1.0)}, 1.0)
    assert found.vertices["ball"][:, 2].max() < 0.8 + 1e-9
    assert found.moved["ball"] < 0.05


def test_nodes_on_the_visible_surface_are_not_outside_of_it_though_faces_are() -> None:
    mesh = ball_hexes(1.0, n=4)
    visible = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    outer = np.unique(mesh.quads(mesh.face_set("outer")))
    height = node_offsets(mesh, "outer", vertices, faces)
    assert np.abs(height).max() < 2e-3
    sunk = mesh.nodes.copy()
    sunk[outer] *= 0.97
    height = node_offsets(replace(mesh, nodes=sunk), "outer", vertices, faces)
    np.testing.assert_allclose(height[outer], 0.03, atol=2e-3)
    assert not np.delete(height, outer).any()
