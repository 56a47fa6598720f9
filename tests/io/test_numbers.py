"""Vertices and facets have the numbers of their files, whatever was welded, split or taken out (R133)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.geometry.surface import weld_surface
from warpjld.grasp import load_object
from warpjld.io import load_rig
from warpjld.io.mesh_file import read_mesh

# a cube whose vertices 0 and 8 lie at one place, as at a seam, with a face of no area and a pentagon on top
CUBE = """\
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
v 0 0 0
v 0.5 1 1
f 1 4 3 2
f 1 2 2
f 5 6 7 10 8
f 9 2 6 5
f 2 3 7 6
f 3 4 8 10 7
f 4 9 5 8
"""
TRIANGLES = {0: 2, 2: 3, 3: 2, 4: 2, 5: 3, 6: 2}  # of each face of the file; face 1 has no area


@pytest.fixture
def cube(tmp_path: Path) -> Path:
    path = tmp_path / "cube.obj"
    path.write_text(CUBE)
    return path


def test_a_surface_keeps_the_files_numbers(cube: Path) -> None:
    file = read_mesh(cube)
    surface = weld_surface(file.vertices, file.faces, parts=file.parts, polygons=file.polygons)
    assert len(surface.vertices) == 9
    assert surface.weld[8] == surface.weld[0]
    np.testing.assert_array_equal(file.vertices[surface.numbers], surface.vertices)
    np.testing.assert_array_equal(surface.numbers, [0, 1, 2, 3, 4, 5, 6, 7, 9])
    assert dict(zip(*np.unique(surface.facets, return_counts=True), strict=True)) == TRIANGLES


def test_an_object_keeps_the_files_numbers(cube: Path) -> None:
    thing = load_object(cube)
    assert thing.numbers is not None
    np.testing.assert_array_equal(read_mesh(cube).vertices[thing.numbers], thing.vertices)
    for facet, count in TRIANGLES.items():
        rows = thing.triangles_of(facet)
        assert len(rows) == count
        assert {thing.facet_of(int(row)) for row in rows} == {facet}
    top = thing.vertices[thing.faces[thing.triangles_of(2)]]
    np.testing.assert_array_equal(top[..., 2], 1.0)
    with pytest.raises(InputError, match="facet 1 of cube was taken out"):
        thing.triangles_of(1)
    with pytest.raises(InputError, match="object cube has facets 0 to 6, got 7"):
        thing.triangles_of(7)


def test_webxr_numbers_are_the_files(data: Path) -> None:
    """They shifted from vertex 9 on."""
    rig = load_rig(data / "hand_webxr_generic" / "left.glb")
    surface = rig.surface
    assert len(surface.weld) > len(surface.vertices)
    source = surface.to_source(surface.vertices)
    np.testing.assert_array_equal(source[surface.numbers], surface.vertices)
    assert (surface.numbers[surface.weld] <= np.arange(len(surface.weld))).all()
    corners = surface.weld[surface.source_faces[surface.facets]]
    np.testing.assert_array_equal(corners, surface.faces)


def test_polygons_of_several_meshes_count_on() -> None:
    from warpjld.io.rig_meshes import RigMesh, joined

    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    faces, bone, whole = np.array([[0, 1, 2], [0, 2, 3]]), np.zeros((4, 1), int), np.ones((4, 1))
    # one face of two corners behind the square gave no triangle, but has a number
    quad = RigMesh("quad", square, faces, bone, whole, polygons=np.array([0, 0]), polygon_count=2)
    plain = RigMesh("plain", square, faces, bone, whole)
    np.testing.assert_array_equal(joined([quad, plain, quad])["polygons"], [0, 0, 2, 3, 4, 4])
    assert joined([plain])["polygons"] is None
