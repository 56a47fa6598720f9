"""Obstacles against brute force in double precision, and against what rigid motion and Barr's maps must do."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles.barr import Barr
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.meshes import Keyframed, RigidMesh
from warpjld.fem.contact.obstacles.obstacle import Obstacle, standing
from warpjld.fem.contact.obstacles.solids import Box, Cylinder, Plane, Sphere
from warpjld.grasp.shapes import glass

TOLERANCE = 1e-6  # of the size, as the contact solver asks for


def moving(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Along a helix, turning."""
    turn = Rotation.from_rotvec(time * np.array([0.3, -0.8, 0.5]))
    return np.array([0.02 * time, -0.01 * time**2, 0.03]), turn.as_quat()


SOLIDS: dict[str, Obstacle] = {
    "plane": Plane((0.01, 0.02, 0.03), (1.0, 2.0, -0.5), moving),
    "sphere": Sphere((0.01, 0.02, 0.03), 0.05, moving),
    "box": Box((0.06, 0.10, 0.04), (0.01, 0.0, -0.02), motion=moving),
    "round box": Box((0.06, 0.10, 0.04), (0.01, 0.0, -0.02), edge=0.008, motion=moving),
    "cylinder": Cylinder(0.03, 0.12, (0.0, 0.01, 0.0), (1.0, 1.0, 0.2), motion=moving),
    "round cylinder": Cylinder(0.03, 0.12, (0.0, 0.01, 0.0), (1.0, 1.0, 0.2), edge=0.006, motion=moving),
}


def cloud(obstacle: Obstacle, time: float, count: int = 2000, seed: int = 0) -> NDArray[np.float64]:
    """Points around an obstacle, half of them close to its surface."""
    rng = np.random.default_rng(seed)
    vertices, faces = obstacle.mesh(time)
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    wide = rng.uniform(vertices.min(axis=0) - 0.2 * size, vertices.max(axis=0) + 0.2 * size, (count // 2, 3))
    weights = rng.dirichlet(np.ones(3), count - len(wide))
    surface = np.einsum("nk,nki->ni", weights, vertices[faces[rng.integers(len(faces), size=len(weights))]])
    return np.concatenate([wide, surface + 0.003 * size * rng.normal(size=surface.shape)])


def triangle_distance(point: NDArray[np.float64], triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """To the planes where the foot of the perpendicular lies between the edges, to the nearest edge elsewhere."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = np.ones(len(triangles), dtype=bool)
    best = np.full(len(triangles), np.inf)
    for k in range(3):
        along, away = triangles[:, (k + 1) % 3] - triangles[:, k], point - triangles[:, k]
        inside &= (np.cross(along, away) * normal).sum(1) >= 0.0
        share = np.clip((away * along).sum(1) / (along * along).sum(1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(away - share[:, None] * along, axis=1))
    return np.where(inside, np.abs(((point - triangles[:, 0]) * normal).sum(1)), best)


def brute_force(points: NDArray[np.float64], vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray:
    """Signed distances to all triangles, the sign by the sum of their solid angles."""
    triangles = vertices[faces]
    found = np.empty(len(points))
    for k, point in enumerate(points):
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        angle = 2.0 * np.arctan2((a * np.cross(b, c)).sum(1), below).sum()
        away = triangle_distance(point, triangles).min()
        found[k] = -away if abs(angle) > 2.0 * np.pi else away
    return found


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_touch_where_they_say(name: str) -> None:
    solid, time = SOLIDS[name], 0.7
    points = cloud(solid, time)
    found = solid.project(points, time)
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points - found.closest, axis=1), np.abs(found.distance), atol=1e-12)
    # the gap lies along the normal, and the closest point is on the surface
    np.testing.assert_allclose(found.closest + found.distance[:, None] * found.normal, points, atol=1e-12)
    np.testing.assert_allclose(solid.project(found.closest, time).distance, 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["sphere", "box", "round box", "cylinder", "round cylinder"])
def test_solids_against_the_facets_they_are_drawn_with(name: str) -> None:
    solid, time = SOLIDS[name], 0.7
    vertices, faces = solid.mesh(time)
    np.testing.assert_allclose(solid.project(vertices, time).distance, 0.0, atol=1e-12)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    points = cloud(solid, time, 24)
    edges = vertices[mesh.edges_unique].mean(axis=1)
    sag = 1.1 * np.abs(solid.project(np.concatenate([mesh.triangles_center, edges]), time).distance).max()
    np.testing.assert_allclose(solid.project(points, time).distance, brute_force(points, vertices, faces), atol=sag)


def egg() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A smooth closed surface that is no sphere."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    x = np.asarray(ball.vertices) * [0.03, 0.05, 0.035]
    x[:, 0] *= 1.0 + 8.0 * x[:, 1]
    return x, np.asarray(ball.faces, dtype=np.int32)


def keyframed() -> Keyframed:
    vertices, faces = egg()
    return Keyframed(faces, [0.0, 1.0, 3.0], [vertices, vertices * [1.2, 0.8, 1.0], vertices + 0.1], moving)


MESHES: dict[str, Obstacle] = {
    "rigid": RigidMesh(*egg(), moving),
    "glass": RigidMesh(glass().vertices, glass().faces, moving),
    "keyframed": keyframed(),
    "barr": Barr(egg(), taper=0.4, twist=lambda t: 1.5 * t, bend=lambda t: 1.0 - t, motion=moving),
}


@pytest.mark.parametrize("name", MESHES)
def test_meshes_against_brute_force(name: str) -> None:
    obstacle, time = MESHES[name], 0.37
    vertices, faces = obstacle.mesh(time)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    points = cloud(obstacle, time, 60)
    found = obstacle.project(points, time)
    np.testing.assert_allclose(found.distance, brute_force(points, vertices, faces), atol=TOLERANCE * size)
    np.testing.assert_allclose(np.linalg.norm(points - found.closest, axis=1), np.abs(found.distance), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-12)


def test_normals_of_a_faceted_ball_are_those_of_the_ball() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    points = cloud(Sphere((0, 0, 0), 1.0), 0.0, 5000)
    points = points[np.linalg.norm(points, axis=1) > 0.5]
    found = RigidMesh(ball.vertices, ball.faces).project(points, 0.0)
    exact = found.closest / np.linalg.norm(found.closest, axis=1, keepdims=True)
    assert np.arccos(np.clip((found.normal * exact).sum(axis=1), -1, 1)).max() < np.radians(0.3)
    # no jump where the closest point goes from one facet to the next
    turn = Rotation.from_rotvec(np.linspace(0.0, 1.0, 20_001)[:, None] * [0.3, 0.9, 0.1])
    around = turn.apply([1.01, 0.2, -0.3])
    step = np.linalg.norm(np.diff(RigidMesh(ball.vertices, ball.faces).project(around, 0.0).normal, axis=0), axis=1)
    assert step.max() < 5.0 * step.mean()


def test_a_box_of_facets_keeps_its_edges() -> None:
    box = trimesh.creation.box((0.06, 0.10, 0.04))
    box = box.subdivide().subdivide()
    exact, facets = Box((0.06, 0.10, 0.04)), RigidMesh(box.vertices, box.faces)
    points = cloud(exact, 0.0, 4000)
    mine, theirs = facets.project(points, 0.0), exact.project(points, 0.0)
    np.testing.assert_allclose(mine.distance, theirs.distance, atol=1e-9)
    nearest_side_is_clear = np.sort(np.abs(np.abs(points) - [0.03, 0.05, 0.02]), axis=1)
    clear = nearest_side_is_clear[:, 1] - nearest_side_is_clear[:, 0] > 1e-6
    np.testing.assert_allclose(mine.normal[clear], theirs.normal[clear], atol=1e-6)


def test_an_open_surface_and_overlapping_parts_have_an_inside() -> None:
    vertices, faces = egg()
    two = np.concatenate([vertices, vertices + np.array([0.02, 0.0, 0.0])])
    both = RigidMesh(two, np.concatenate([faces, faces + len(vertices)]))
    assert (both.project(np.array([[0.0, 0, 0], [0.01, 0, 0], [0.02, 0, 0]]), 0.0).distance < 0).all()
    cup = RigidMesh(vertices, faces[vertices[faces].mean(axis=1)[:, 1] < 0.04])
    assert (cup.project(np.array([[0.0, -0.02, 0.0]]), 0.0).distance < 0).all()


@pytest.mark.parametrize("shift", [[0, 0, 0], [0.3, 0, 0], [0, 0, 0.3], [0, 0, -0.3], [0.4, 1.1, -0.2]])
def test_an_open_surface_faces_the_same_way_wherever_it_lies(shift: list[float]) -> None:
    """A cup without a lid, as flesh of a cut finger is, far from the origin."""
    cup = trimesh.creation.cylinder(0.01, 0.06)
    faces = cup.faces[cup.face_normals[:, 2] < 0.9]
    found = Facets(cup.vertices + shift, faces).project(np.array([[0.0, 0.0, -0.02], [0.0, 0.0, -0.04]]) + shift)
    assert found.distance == pytest.approx([-0.01, 0.01], rel=0.02)


@pytest.mark.parametrize("name", [*SOLIDS, *MESHES])
def test_what_is_carried_stays_on_the_surface(name: str) -> None:
    obstacle = {**SOLIDS, **MESHES}[name]
    on = obstacle.project(cloud(obstacle, 0.2, 400), 0.2).closest
    there = obstacle.carried(on, 0.2, 0.9)
    size = float(np.linalg.norm(np.ptp(obstacle.mesh(0.2)[0], axis=0)))
    sag = 2e-3 * size if name == "barr" else 1e-9 * size  # Barr's maps bend the facets too
    np.testing.assert_allclose(obstacle.project(there, 0.9).distance, 0.0, atol=sag)
    np.testing.assert_allclose(obstacle.carried(there, 0.9, 0.2), on, atol=1e-9 * size)
    assert np.linalg.norm(there - on, axis=1).max() > 1e-3


def test_rigid_motion_moves_everything_along() -> None:
    still, moved = Box((0.06, 0.10, 0.04), edge=0.01), Box((0.06, 0.10, 0.04), edge=0.01, motion=moving)
    points = cloud(still, 0.0)
    position, rotation = moving(0.8)
    turn = Rotation.from_quat(rotation)
    there = turn.apply(points) + position
    here, then = still.project(points, 0.8), moved.project(there, 0.8)
    np.testing.assert_allclose(then.distance, here.distance, atol=1e-15)
    np.testing.assert_allclose(then.closest, turn.apply(here.closest) + position, atol=1e-15)
    np.testing.assert_allclose(then.normal, turn.apply(here.normal), atol=1e-15)
    np.testing.assert_allclose(moved.carried(there, 0.8, 0.0), points + moving(0.0)[0], atol=1e-15)


def test_barr_maps() -> None:
    rod = Box((0.02, 0.10, 0.02), edge=0.001)
    ends = np.array([[0.01, -0.05, 0.0], [0.01, 0.05, 0.0], [0.0, -0.05, 0.01], [0.0, 0.05, 0.01]])
    tapered = Barr(rod, taper=0.5).carried(ends, 0.0, 0.0)
    np.testing.assert_allclose(tapered, ends, atol=1e-15)
    grown = {
        "taper": Barr(rod, taper=lambda t: 0.5 * t),
        "twist": Barr(rod, twist=lambda t: 0.5 * np.pi * t),
        "bend": Barr(rod, bend=lambda t: 0.5 * np.pi * t),
    }
    moved = {kind: deformed.carried(ends, 0.0, 1.0) for kind, deformed in grown.items()}
    np.testing.assert_allclose(moved["taper"][:2, 0], [0.01, 0.005], atol=1e-12)
    quarter = Rotation.from_rotvec([0.0, 0.25 * np.pi, 0.0])
    np.testing.assert_allclose(moved["twist"][1], quarter.apply([0.01, 0.05, 0.0]), atol=1e-12)
    # bent by 90° in all: an arc of the rod's length, its ends turned by 45°, towards z
    radius = 0.10 / (0.5 * np.pi)
    end = [0.01, radius * np.sin(np.pi / 4), radius * (1 - np.cos(np.pi / 4))]
    np.testing.assert_allclose(moved["bend"][1], end, atol=1e-12)
    # the far corner's normals: at rest ±y, at the end of the bend turned by 45°
    cap = grown["bend"].project(np.array([end]) + np.array([-0.01, 1e-4, 1e-4]), 1.0)
    np.testing.assert_allclose(cap.normal[0], [0.0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-3)
    back = grown["bend"].carried(moved["bend"], 1.0, 0.0)
    np.testing.assert_allclose(back, ends, atol=1e-12)


def test_barr_normals_are_those_of_the_smooth_shape() -> None:
    cylinder = Cylinder(0.02, 0.12)
    shape = Barr(cylinder, twist=1.0, bend=0.9, taper=0.3)
    vertices, faces = shape.mesh(0.0)
    centres = vertices[faces].mean(axis=1)
    side = np.abs(cylinder.mesh(0.0)[0][faces].mean(axis=1)[:, 1]) < 0.055
    found = shape.project(centres[side], 0.0)
    flat = np.cross(vertices[faces][:, 1] - vertices[faces][:, 0], vertices[faces][:, 2] - vertices[faces][:, 0])[side]
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert (found.normal * flat).sum(axis=1).min() > np.cos(np.radians(3.0))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Sphere((0, 0, 0), 0.0), "sphere radius: want metres above 0"),
        (lambda: Plane(normal=(0, 0, 0)), "plane normal: has no direction"),
        (lambda: Box((1, -1, 1)), "box size: want three finite numbers above 0"),
        (lambda: Box((1, 1, 1), edge=0.6), "box edge: want a radius of 0 to 0.5 m"),
        (lambda: Cylinder(1.0, np.nan), "cylinder length"),
        (lambda: RigidMesh(np.zeros((3, 3)), [[0, 1, 2]]), "no triangle has an area"),
        (lambda: RigidMesh(np.eye(3), [[0, 1, 3]]), r"must lie in 0…2"),
        (lambda: Keyframed([[0, 1, 2]], [0.0, 0.0], np.tile(np.eye(3), (2, 1, 1))), "increasing times"),
        (lambda: Barr(egg(), axis="w"), "want x, y or z"),  # type: ignore[arg-type]
        (lambda: Barr(egg(), taper=1.0).project(np.zeros((1, 3)), 0.0), "taper below 1"),
        (lambda: standing((0, 0, np.inf)), "want a finite position"),
        (lambda: Sphere((0, 0, 0), 1.0).project(np.full((1, 3), np.nan), 0.0), "point 0 is not finite"),
        (lambda: Sphere((0, 0, 0), 1.0).project(np.zeros(3), 0.0), r"want shape \(n, 3\)"),
    ],
)
def test_wrong_obstacles(wrong, message: str) -> None:
    with pytest.raises(InputError, match=message):
        wrong()


def test_a_hundred_thousand_points() -> None:
    obstacle = MESHES["glass"]
    points = cloud(obstacle, 0.0, 100_000)
    whole = obstacle.project(points, 0.0)
    np.testing.assert_array_equal(whole.distance[:100], obstacle.project(points[:100], 0.0).distance)
    np.testing.assert_array_equal(whole.distance, obstacle.project(points, 0.0).distance)
