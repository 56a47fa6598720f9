"""What presses on nodes, spread over visible surfaces: the sum stays, and so does the peak."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from warpjld.fem import HexMesh, ball_hexes, merge
from warpjld.fem.contact.results.nodal_contact import tributary_areas
from warpjld.fem.mesh.embedding import Embedding, embed
from warpjld.simulation.display.pressure_map import PressureMap, pressure_map
from warpjld.simulation.display.refine import RefinedSurface, refine_surface

MESH = ball_hexes(1.0, n=8)
OUTER = np.unique(MESH.quads(MESH.face_set("outer")))


def cap(mesh: HexMesh) -> np.ndarray:
    """Pressure that falls from 1 at the pole to 0 at half a radius from it, as forces on the nodes."""
    away = np.linalg.norm(mesh.nodes - [0.0, 0.0, 1.0], axis=1)
    return np.maximum(1.0 - (away / 0.5) ** 2, 0.0) * tributary_areas(mesh, "outer", mesh.nodes)


def mapped(
    mesh: HexMesh,
    carried: Embedding,
    vertices: np.ndarray,
    faces: np.ndarray,
    force: np.ndarray,
    embedded: np.ndarray | None = None,
) -> tuple[RefinedSurface, PressureMap]:
    some = np.ones(len(vertices), dtype=bool) if embedded is None else embedded
    body = SimpleNamespace(
        mesh=mesh, faces="outer", embedding=carried, surface=vertices, triangles=faces, embedded=some
    )
    return pressure_map(body, force)  # type: ignore[arg-type]


def integral(vertices: np.ndarray, faces: np.ndarray, values: np.ndarray) -> float:
    x = vertices[faces]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    return float(area @ values[faces].mean(axis=1))


@pytest.mark.parametrize("detail", [1, 3, 4])
def test_the_integral_is_the_force(detail: int) -> None:
    """On surfaces coarser than the elements, alike, and finer, at rest and deformed."""
    visible = trimesh.creation.icosphere(detail)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    force = cap(MESH)
    surface, spread = mapped(MESH, embed(MESH, vertices, reach=3.0), vertices, faces, force)
    for stretch in (np.ones(3), np.array([1.2, 1.0, 0.8])):
        at = surface.of(vertices * stretch)
        found = spread.of(force, at)
        assert integral(at, surface.faces, found) == pytest.approx(force.sum(), rel=1e-12)
        assert (found >= 0.0).all()


def test_the_peak_is_that_of_the_nodes() -> None:
    visible = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    force = cap(MESH)
    around = tributary_areas(MESH, "outer", MESH.nodes)
    highest = float((force[OUTER] / around[OUTER]).max())
    surface, spread = mapped(MESH, embed(MESH, vertices, reach=3.0), vertices, faces, force)
    found = spread.of(force, surface.of(vertices))
    assert found.max() == pytest.approx(highest, rel=0.06)
    assert found[surface.of(vertices)[:, 2] < 0.5].max() == 0.0


def test_what_a_cut_off_surface_lacks_goes_to_its_border() -> None:
    """Nodes whose own surface is not carried press on what is nearest to them."""
    visible = trimesh.creation.icosphere(4)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    worn = vertices[:, 0] > 0.0
    force = cap(MESH)
    surface, spread = mapped(MESH, embed(MESH, vertices, reach=3.0), vertices, faces, force, worn)
    found = spread.of(force, surface.of(vertices))
    assert integral(surface.of(vertices), surface.faces, found) == pytest.approx(force.sum(), rel=1e-12)
    assert not found[: len(vertices)][~worn].any()


def test_finer_triangles_fit_those_beside_them() -> None:
    visible = trimesh.creation.icosphere(2)
    vertices, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    chosen = np.random.default_rng(1).random(len(faces)) < 0.3
    found = refine_surface(faces, chosen, len(vertices))
    fine = trimesh.Trimesh(found.of(vertices), found.faces, process=False)
    assert fine.is_watertight
    assert fine.is_winding_consistent
    assert fine.volume == pytest.approx(visible.volume, rel=1e-12)
    assert len(found.faces) >= len(faces) + 3 * chosen.sum()
    whole = refine_surface(faces, np.zeros(len(faces), dtype=bool), len(vertices))
    np.testing.assert_array_equal(whole.faces, faces)
    np.testing.assert_array_equal(whole.of(vertices), vertices)


def test_what_lies_beside_another_part_takes_nothing_of_its_pressure() -> None:
    """Two balls that touch as one skin: one is pressed where they touch, and the other shows nothing."""
    mesh = merge(*(replace(MESH, nodes=MESH.nodes + shift, faces={f"{k}.outer": MESH.faces["outer"]}) for k, shift in
                   enumerate(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))))  # fmt: skip
    outer = np.concatenate([mesh.face_set("0.outer"), mesh.face_set("1.outer")])
    mesh = replace(mesh, faces={"outer": outer})
    visible = trimesh.creation.icosphere(4)
    x, faces = np.asarray(visible.vertices), np.asarray(visible.faces, np.int32)
    vertices, both = np.concatenate([x, x + np.array([0.0, 0.0, 2.0])]), np.concatenate([faces, faces + len(x)])
    apart = embed(MESH, x, reach=3.0)
    corners = np.concatenate([apart.corners, apart.corners + len(MESH.nodes)])
    carried = Embedding(corners, np.tile(apart.weights, (2, 1)), np.tile(apart.outside, 2))
    force = np.concatenate([cap(MESH), np.zeros(len(MESH.nodes))])
    surface, spread = mapped(mesh, carried, vertices, both, force)
    found = spread.of(force, surface.of(vertices))
    other = np.zeros(len(vertices), dtype=bool)
    other[len(x) :] = True
    of_middles = other[surface.edges].all(axis=1)
    assert not found[np.concatenate([other, of_middles])].any()
    assert found.max() == pytest.approx(
        float((cap(MESH)[OUTER] / tributary_areas(MESH, "outer", MESH.nodes)[OUTER]).max()), rel=0.06
    )
