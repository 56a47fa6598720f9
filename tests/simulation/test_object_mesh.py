"""Volumes of objects: shapes, walls, and the stress that holds a pressure."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.fem import Body, Loads, Prescribed, solve
from warpjld.fem.load.loads import volumes
from warpjld.grasp import GraspObject, Places, make_object
from warpjld.grasp.shapes import ball, box, cylinder, glass
from warpjld.simulation.bodies.object_body import object_body
from warpjld.simulation.bodies.object_mesh import ObjectMesh, mesh_object
from warpjld.simulation.specification import ObjectMaterial

PLACE = Places.of((0.1, 0.2, 0.3), (0.1, 0.2, 0.3, 0.9))
NOTHING = Prescribed(np.empty(0, np.int64), np.empty(0))


def capsule() -> GraspObject:
    """A surface that no regular mesh is made for."""
    mesh = trimesh.creation.capsule(height=0.05, radius=0.02)
    return make_object("capsule", mesh.vertices, mesh.faces)


def made(thing: GraspObject, **options: float) -> ObjectMesh:
    return mesh_object("X", thing, ObjectMaterial(**options), PLACE)  # type: ignore[arg-type]


def deformed(found: ObjectMesh, displacement: np.ndarray) -> np.ndarray:
    return object_body(found, lambda time: PLACE, [], 0.0).deformed(displacement)


@pytest.mark.parametrize("thing", [ball(0.06), box(), cylinder(), capsule()], ids=lambda thing: thing.name)
def test_solid_objects_fill_their_surface(thing: GraspObject) -> None:
    found = made(thing, element=0.005)
    assert volumes(found.mesh).sum() == pytest.approx(thing.volume, rel=0.03)
    np.testing.assert_allclose(
        deformed(found, np.zeros_like(found.mesh.nodes)), PLACE.apply(thing.vertices)[0], atol=1e-12
    )
    moved = deformed(found, np.tile([0.0, 0.01, 0.0], (len(found.mesh.nodes), 1)))
    np.testing.assert_allclose(moved - found.surface, np.tile([0.0, 0.01, 0.0], (len(moved), 1)), atol=1e-9)
    assert set(found.mesh.faces) == {"X"}
    np.testing.assert_allclose(PLACE.apply(found.local)[0], found.mesh.nodes, atol=1e-12)


@pytest.mark.parametrize("thing", [ball(0.06), cylinder()], ids=lambda thing: thing.name)
def test_hollow_objects_have_a_wall(thing: GraspObject) -> None:
    wall = 0.003
    found = made(thing, element=0.005, wall=wall)
    corners = thing.vertices[thing.faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    # a wall of even depth inside a surface that curves is smaller than area times depth
    assert 0.85 * area * wall < volumes(found.mesh).sum() < area * wall
    assert set(found.mesh.faces) == {"X", "X.inside"}
    assert len(found.mesh.boundary()) == len(found.mesh.faces["X"]) + len(found.mesh.faces["X.inside"])


def test_the_wall_of_a_box_is_as_thick_at_its_edges() -> None:
    thing, wall = box(0.036, 0.02, 0.03), 0.002
    found = made(thing, element=0.004, wall=wall)
    inside = thing.size - 2.0 * wall
    assert volumes(found.mesh).sum() == pytest.approx(thing.size.prod() - inside.prod(), rel=1e-9)
    np.testing.assert_allclose(
        deformed(found, np.zeros_like(found.mesh.nodes)), PLACE.apply(thing.vertices)[0], atol=1e-12
    )


def test_a_pressurised_ball_keeps_its_shape() -> None:
    thing = ball(0.065)
    found = made(thing, wall=0.003, pressure=2e4, young=1e6, element=0.006)
    inner, outer = 0.0295, 0.0325
    hoop = 2e4 * inner**2 / (outer**2 - inner**2)  # its mean through the wall, whatever the law: half a ball balances
    assert np.sort(np.linalg.eigvalsh(_full(found.stress)), axis=1)[:, 1:].mean() == pytest.approx(hoop, rel=0.02)
    moved = []
    for stress in (found.stress, None):
        body = Body(found.mesh, {"X": found.physical.material()}, initial_stress=stress)
        solution = solve(body, NOTHING, Loads(pressure={"X.inside": 2e4}), free="hold")
        moved.append(float(np.linalg.norm(solution.displacement, axis=1).max()))
    assert moved[0] < 0.02 * moved[1]
    assert moved[0] < 1e-4


def test_thin_walls_get_elements_small_enough() -> None:
    """Elements of 16 mm leave out a wall of 6 mm: they are smaller, and the object weighs what it does."""
    thing = glass(0.05, 0.05, thickness=0.006)
    found = made(thing, element=0.016, density=400.0)
    assert any("would leave out thin parts: they are 0.01 m" in note for note in found.notes)
    assert any("of the object's volume" in note for note in found.notes)
    assert found.physical.density * volumes(found.mesh).sum() == pytest.approx(400.0 * thing.volume, rel=1e-6)
    assert found.visible.outside.max() <= 3.0
    assert not any("would leave out" in note for note in made(thing, element=0.012).notes)


def test_volumes_that_cannot_be() -> None:
    with pytest.raises(InputError, match=r"elements of 0\.02 m are too large|too coarse"):
        made(glass(), element=0.02)
    for wall in (0.0, 0.002):
        with pytest.raises(InputError, match=r"elements of 5e-05 m would be some [0-9,]+: more than can be"):
            made(ball(0.06), element=5e-5, wall=wall)
    with pytest.raises(InputError, match=r"would burst a wall of 0\.0005 m"):
        made(ball(0.06), wall=0.0005, pressure=1e6, young=1e5)


def _full(stress: np.ndarray) -> np.ndarray:
    return stress[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
