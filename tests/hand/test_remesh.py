"""Remeshing on a sphere, where everything is known."""

import numpy as np
import pytest
import trimesh

from warpjld.hand.contour import contour
from warpjld.hand.mesh import ManifoldEdges, subdivide
from warpjld.hand.remesh import remesh


def sphere(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points, axis=1) - 10.0


@pytest.fixture(scope="module")
def raw() -> tuple[np.ndarray, np.ndarray]:
    return contour(sphere, np.full(3, -14.0), np.full(3, 14.0), 0.8)


def test_contour_is_a_closed_sphere_seen_from_outside(raw: tuple[np.ndarray, np.ndarray]) -> None:
    mesh = trimesh.Trimesh(*raw, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(4.0 / 3.0 * np.pi * 1000.0, rel=0.01)


@pytest.mark.parametrize("size", [0.6, 1.0, 2.0])
def test_edges_become_even(raw: tuple[np.ndarray, np.ndarray], size: float) -> None:
    vertices, faces = raw
    vertices, faces, _ = remesh(vertices, faces, np.full(len(vertices), size), sphere, 10)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 2
    assert np.abs(sphere(vertices)).max() < 0.05 * size
    assert np.degrees(mesh.face_angles.min()) > 25.0
    lengths = mesh.edges_unique_length
    assert lengths.min() > 0.5 * size
    assert lengths.max() < 1.7 * size


def test_a_graded_size_is_followed(raw: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = raw
    wanted = np.where(vertices[:, 0] > 0.0, 0.7, 2.0)
    vertices, faces, _ = remesh(vertices, faces, wanted, sphere, 10)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    middle = vertices[mesh.edges_unique].mean(axis=1)[:, 0]
    fine, rough = mesh.edges_unique_length[middle > 5.0], mesh.edges_unique_length[middle < -5.0]
    assert np.median(rough) > 2.0 * np.median(fine)


def test_edges_know_their_faces(raw: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = raw
    edges = ManifoldEdges.of(faces, len(vertices))
    assert len(edges.ends) == 3 * len(faces) // 2
    for side in range(2):
        start = faces[edges.faces[:, side], edges.corners[:, side]]
        end = faces[edges.faces[:, side], (edges.corners[:, side] + 1) % 3]
        np.testing.assert_array_equal(np.sort(np.column_stack([start, end]), axis=1), edges.ends)
    assert edges.joined(edges.ends[:, 1], edges.ends[:, 0]).all()
    assert not edges.joined(edges.ends[:5, 0], edges.ends[:5, 0]).any()


def test_subdivision_keeps_the_surface(raw: tuple[np.ndarray, np.ndarray]) -> None:
    vertices, faces = subdivide(*raw)
    mesh, before = (trimesh.Trimesh(v, f, process=False) for v, f in ((vertices, faces), raw))
    assert len(faces) == 4 * len(raw[1])
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(before.volume, rel=1e-6)
