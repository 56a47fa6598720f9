"""Meshes: structured, fitted, degenerate, exchanged; surfaces carried by them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.fem import (
    Body,
    HexMesh,
    LinearElastic,
    Loads,
    ball_hexes,
    box_hexes,
    cylinder_hexes,
    finger_hexes,
    merge,
    prescribe,
    solve,
)
from warpjld.fem.mesh.core import core_of, make_manifold
from warpjld.fem.mesh.embedding import embed
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.fit import fit_mesh


def volume(mesh: HexMesh) -> float:
    x = mesh.nodes[mesh.quads(mesh.boundary())]
    return float(np.einsum("fi,fi->", x.mean(axis=1), np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]))) / 6.0


@pytest.mark.parametrize(
    ("mesh", "exact"),
    [
        (box_hexes((1, 2, 3), (2, 3, 4)), 6.0),
        (ball_hexes(1.0, n=12), 4.18879),
        (ball_hexes(1.0, inner=0.5, n=12), 3.66519),
        (ball_hexes(1.0, n=8, octant=True), 0.523599),
        (cylinder_hexes(1.0, 2.0, n=12), 6.28319),
        (cylinder_hexes(1.0, 2.0, inner=0.5, n=12), 4.71239),
        (finger_hexes(1.0, 4.0, n=12), 3.0 * np.pi + 2.0 / 3.0 * np.pi),
    ],
)
def test_structured_meshes(mesh: HexMesh, exact: float) -> None:
    assert volume(mesh) == pytest.approx(exact, rel=0.015)
    assert mesh.scaled_jacobian().min() > 0.6
    named = np.concatenate(list(mesh.faces.values()))
    boundary = mesh.boundary()
    assert {tuple(f) for f in named} == {tuple(f) for f in boundary}
    assert len(named) == len(boundary)
    for grid in mesh.blocks:
        assert grid.min() >= 0


def prisms() -> HexMesh:
    """A cube of two prisms."""
    cube = box_hexes(counts=(1, 1, 1))
    a, b, c, d, e, f, g, h = cube.elements[0]
    elements = np.array([[a, b, c, c, e, f, g, g], [a, c, d, d, e, g, h, h]], np.int32)
    return HexMesh(cube.nodes, elements, np.zeros(2, np.int32))


def tetrahedra() -> HexMesh:
    """A cube of six tetrahedra."""
    cube = box_hexes(counts=(1, 1, 1))
    corner = cube.elements[0]
    four = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
    elements = [corner[[a, b, c, c, d, d, d, d]] for a, b, c, d in four]
    return HexMesh(cube.nodes, np.array(elements, np.int32), np.zeros(6, np.int32))


@pytest.mark.parametrize("mesh", [prisms(), tetrahedra()], ids=["prisms", "tetrahedra"])
def test_degenerate_elements_pass_the_patch_test(mesh: HexMesh) -> None:
    gradient = np.array([[0.1, 0.2, 0.0], [0.2, -0.3, 0.1], [0.0, 0.1, 0.2]])
    exact = mesh.nodes @ gradient
    held = prescribe(mesh, np.arange(7), displacement=exact[:7])
    found = solve(Body(mesh, LinearElastic(1.0, 0.3)), held, Loads())
    stress = np.einsum("ij,ij->", gradient, gradient) / 1.3 + 0.3 / (1.3 * 0.4) * np.trace(gradient) ** 2
    body = Body(mesh, LinearElastic(1.0, 0.3))
    assert (exact.ravel() @ body.at(exact).forces) == pytest.approx(stress, rel=1e-12)
    assert found.converged
    # triangles count with half a quad: the boundary of a cube is closed either way
    assert volume(mesh) == pytest.approx(1.0, rel=1e-12)


def test_boundary_of_tetrahedra_is_its_twelve_triangles() -> None:
    assert len(tetrahedra().boundary()) == 12
    assert len(prisms().boundary()) == 8


@pytest.mark.parametrize("shape", ["ball", "capsule", "box"])
def test_fitted_mesh(shape: str) -> None:
    surface = {
        "ball": trimesh.creation.icosphere(3),
        "capsule": trimesh.creation.capsule(1.0, 0.4),
        "box": trimesh.creation.box(),
    }[shape]
    envelope = Envelope(surface.vertices, surface.faces)
    fit = fit_mesh(envelope, {"ball": 0.25, "capsule": 0.13, "box": 0.13}[shape])
    assert fit.least == pytest.approx(fit.mesh.scaled_jacobian().min())
    assert fit.least > 0.3
    assert fit.gap < 1e-5 * envelope.size
    assert 0.85 < fit.volume < 1.01
    assert volume(fit.mesh) == pytest.approx(fit.volume * envelope.volume, rel=1e-6)
    assert {tuple(f) for f in fit.mesh.faces["surface"]} == {tuple(f) for f in fit.mesh.boundary()}
    assert not fit.notes


def test_surface_with_a_hole_is_meshed_and_reported() -> None:
    surface = trimesh.creation.icosphere(3)
    faces = surface.faces[surface.triangles_center[:, 2] < 0.93]
    fit = fit_mesh(Envelope(surface.vertices, faces[:, ::-1]), 0.25)
    assert "not watertight" in fit.notes[0]
    assert 0.85 < fit.volume * 1.0 < 1.1


def test_fitted_mesh_solves_with_few_iterations() -> None:
    surface = trimesh.creation.icosphere(3)
    mesh = fit_mesh(Envelope(surface.vertices, surface.faces), 0.2).mesh
    held = prescribe(mesh, np.flatnonzero(mesh.nodes[:, 2] < -0.6), x=0, y=0, z=0)
    found = solve(Body(mesh, LinearElastic(1.0, 0.3)), held, Loads(gravity=(0, 0, -1e-3)), method="multigrid")
    assert found.last.iterations < 20


@pytest.mark.parametrize("spacing", [0.0, -1.0, 3.0])
def test_spacing_that_makes_no_mesh(spacing: float) -> None:
    surface = trimesh.creation.icosphere(2)
    with pytest.raises(InputError, match="spacing"):
        fit_mesh(Envelope(surface.vertices, surface.faces), spacing)


def test_flat_surface_has_no_inside() -> None:
    with pytest.raises(InputError, match="encloses no volume"):
        Envelope([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_manifold_cells() -> None:
    rng = np.random.default_rng(3)
    cells = np.zeros((14, 14, 14), dtype=bool)
    cells[2:-2, 2:-2, 2:-2] = rng.random((10, 10, 10)) < 0.6
    kept = make_manifold(cells)
    assert not (kept & ~cells).any()
    from warpjld.fem.mesh.hexmesh import elements_of

    grid = elements_of(np.arange(15**3, dtype=np.int32).reshape(15, 15, 15))[kept.ravel()]
    used, corners = np.unique(grid, return_inverse=True)
    mesh = HexMesh(
        np.zeros((len(used), 3)) + np.arange(len(used))[:, None], corners.reshape(-1, 8).astype(np.int32),
        np.zeros(len(grid), np.int32),
    )  # fmt: skip
    quads = mesh.quads(mesh.boundary())
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_embedded_points_follow_a_linear_field_exactly() -> None:
    mesh = ball_hexes(1.0, n=8)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(400, 3))
    points *= (rng.random(400) ** (1 / 3) * 1.01 / np.linalg.norm(points, axis=1))[:, None]
    carried = embed(mesh, points)
    gradient = rng.normal(size=(3, 3))
    np.testing.assert_allclose(carried.carry(mesh.nodes @ gradient), points @ gradient, atol=1e-9)
    assert (carried.outside == 0).mean() > 0.9
    with pytest.raises(InputError, match="outside the mesh"):
        embed(mesh, np.array([[5.0, 0.0, 0.0]]))


def test_points_beside_squashed_elements_are_as_far_outside_as_their_distance() -> None:
    """Elements of edge 1, but for a last layer of a fiftieth: half an edge beyond it is no 25 sizes outside."""
    from warpjld.fem.mesh.hexmesh import elements_of

    x = np.array([0.0, 1.0, 2.0, 3.0, 3.02])
    nodes = np.stack(np.meshgrid(x, x[:4], x[:4], indexing="ij"), axis=-1).reshape(-1, 3)
    elements = elements_of(np.arange(len(nodes), dtype=np.int32).reshape(5, 4, 4)).reshape(-1, 8)
    mesh = HexMesh(nodes, elements, np.zeros(len(elements), np.int32))
    beside = np.array([[3.52, 1.5, 1.5]])
    np.testing.assert_allclose(embed(mesh, beside).outside, [0.5], atol=0.05)
    with pytest.raises(InputError, match="lies 2 element sizes outside the mesh, more than 1"):
        embed(mesh, beside + np.array([1.5, 0.0, 0.0]))


@pytest.mark.parametrize(("suffix", "form"), [(".vtu", "vtu"), (".inp", "abaqus"), (".msh", "gmsh"), (".msh", "ansys")])
def test_exchange(tmp_path: Path, suffix: str, form: str) -> None:
    meshio = pytest.importorskip("meshio")
    from warpjld.fem.mesh.exchange import read_volume_mesh

    mesh = ball_hexes(1.0, n=2)
    meshio.write(tmp_path / f"ball{suffix}", meshio.Mesh(mesh.nodes, [("hexahedron", mesh.elements)]), form)
    again = read_volume_mesh(tmp_path / f"ball{suffix}")
    np.testing.assert_allclose(again.nodes[again.elements], mesh.nodes[mesh.elements], atol=1e-12)


def test_tetrahedra_are_read_as_degenerate_hexahedra(data: Path) -> None:
    pytest.importorskip("meshio")
    from warpjld.fem.mesh.exchange import read_volume_mesh

    path = next((data / "bell_pepper").glob("*.vtk"))
    mesh = read_volume_mesh(path)
    assert len(mesh.elements) == 2519
    low = np.flatnonzero(mesh.nodes[:, 2] < np.percentile(mesh.nodes[:, 2], 20))
    held = prescribe(mesh, low, x=0, y=0, z=0)
    body = Body(mesh, LinearElastic(1e5, 0.3))
    direct = solve(body, held, Loads(gravity=(9.81, 0, 0)), method="direct")
    iterated = solve(body, held, Loads(gravity=(9.81, 0, 0)), method="multigrid", tolerance=1e-10)
    np.testing.assert_allclose(
        iterated.displacement, direct.displacement, atol=1e-7 * np.abs(direct.displacement).max()
    )


def test_merged_bodies_are_solved_apart() -> None:
    left, right = box_hexes(counts=(3, 3, 3), name="left"), box_hexes(origin=(2, 0, 0), counts=(2, 2, 2), name="right")
    both = merge(left, right)
    assert both.region_names == ("left", "right")
    laws = {"left": LinearElastic(1.0, 0.3), "right": LinearElastic(2.0, 0.3)}
    found = solve(Body(both, laws), prescribe(both, "z-", x=0, y=0, z=0), Loads(traction={"z+": (0, 0, 0.1)}))
    alone = solve(
        Body(right, LinearElastic(2.0, 0.3)), prescribe(right, "z-", x=0, y=0, z=0), Loads(traction={"z+": (0, 0, 0.1)})
    )
    np.testing.assert_allclose(found.displacement[len(left.nodes) :], alone.displacement, atol=1e-9)


def test_inverted_corner_has_a_negative_scaled_jacobian() -> None:
    mesh = box_hexes(counts=(1, 1, 1))
    nodes = mesh.nodes.copy()
    nodes[7] = [-0.5, -0.5, -0.5]
    assert replace(mesh, nodes=nodes).scaled_jacobian()[0] < 0


def test_far_nodes_answer_for_those_around() -> None:
    """Cells of a grid are those that every node's and every half's own distance gives."""
    surface = trimesh.creation.capsule(height=1.3, radius=0.31, count=[24, 24])
    surface.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1.0, 2.0, 0.5]))
    envelope = Envelope(surface.vertices, surface.faces)
    assert envelope.closed
    cells, low = core_of(envelope, 0.07, [])
    envelope.closed = False
    plain, same = core_of(envelope, 0.07, [])
    assert low.tobytes() == same.tobytes()
    np.testing.assert_array_equal(cells, plain)
    opened = Envelope(surface.vertices, np.concatenate([surface.faces[5:40], surface.faces[44:]]))
    assert not Envelope(surface.vertices, np.concatenate([surface.faces, surface.faces[:1]])).closed
    assert opened.open_edges > 0
