"""PLY as it stands in the file: text and binary, polygons of any shape, texture coordinates of vertices and corners."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.grasp import load_object
from warpjld.io.mesh_file import read_mesh

FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")

# an L, 60 by 60 with legs 20 wide, 30 high: two faces of 2,000 and a border of 240, and a vertex that no face uses
OUTLINE = [(60, 0), (60, 20), (20, 20), (20, 60), (0, 60), (0, 0)]
POINTS = np.array([(1, 2, 3), *((x, 0, z) for x, z in OUTLINE), *((x, 30, z) for x, z in OUTLINE)], float)
POLYGONS = [[1, 2, 3, 4, 5, 6], [12, 11, 10, 9, 8, 7]] + [
    corner
    for i in range(6)
    for a, b in [(1 + i, 1 + (i + 1) % 6)]
    for corner in ([[a, a + 6, b + 6, b]] if i % 2 else [[a, a + 6, b + 6], [a, b + 6, b]])
]


def ply(path: Path, form: str, *, uv=None, corner_uv=None, double: bool = False, polygons=POLYGONS) -> Path:
    """Written as the format's description says, with elements and properties that nobody asked for."""
    real = "double" if double else "float"
    lines = ["ply", f"format {form} 1.0", "comment made here", "element odd 1", "property list uchar short many"]
    lines += [f"element vertex {len(POINTS)}", *(f"property {real} {axis}" for axis in "xyz"), "property uchar red"]
    lines += [] if uv is None else ["property float s", "property float t"]
    lines += [f"element face {len(polygons)}", "property list uchar int vertex_indices"]
    lines += [] if corner_uv is None else ["property list uchar float texcoord"]
    rows: list[list[tuple[str, object]]] = [[("B", 2), ("h", 7), ("h", -8)]]
    for i, point in enumerate(POINTS):
        texture = [] if uv is None else [("f", value) for value in uv[i]]
        rows.append([*(("d" if double else "f", value) for value in point), ("B", 200), *texture])
    for i, polygon in enumerate(polygons):
        texture = [] if corner_uv is None else [("B", 2 * len(polygon)), *(("f", x) for x in corner_uv[i].ravel())]
        rows.append([("B", len(polygon)), *(("i", corner) for corner in polygon), *texture])
    head = "\n".join([*lines, "end_header\n"]).encode()
    if form == "ascii":
        body = "".join(" ".join(repr(float(v)) if c in "fd" else str(v) for c, v in row) + "\n" for row in rows)
        path.write_bytes(head + body.encode())
    else:
        order = "<" if "little" in form else ">"
        path.write_bytes(head + b"".join(struct.pack(order + c, v) for row in rows for c, v in row))
    return path


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("double", [False, True])
def test_vertices_and_concave_polygons(tmp_path: Path, form: str, double: bool) -> None:
    mesh = read_mesh(ply(tmp_path / "a.ply", form, double=double))
    np.testing.assert_array_equal(mesh.vertices, POINTS)
    assert area(mesh.vertices, mesh.faces) == pytest.approx(11_200)
    thing = load_object(tmp_path / "a.ply", unit="mm")
    assert thing.volume * 1e9 == pytest.approx(60_000)
    assert thing.report.solid


@pytest.mark.parametrize("form", FORMATS)
def test_texture_coordinates(tmp_path: Path, form: str) -> None:
    rng = np.random.default_rng(6)
    uv = rng.random((len(POINTS), 2)).astype(np.float32)
    mesh = read_mesh(ply(tmp_path / "a.ply", form, uv=uv))
    np.testing.assert_array_equal(mesh.uv, uv)
    corner_uv = [rng.random((len(polygon), 2)).astype(np.float32) for polygon in POLYGONS]
    mesh = read_mesh(ply(tmp_path / "b.ply", form, corner_uv=corner_uv))
    assert mesh.uv is None
    assert len(mesh.vertices) == len(POINTS)
    told = np.column_stack([np.concatenate(POLYGONS), np.concatenate(corner_uv)])
    found = np.column_stack([mesh.faces.ravel(), mesh.corner_uv.reshape(-1, 2)])
    assert set(map(tuple, found)) == set(map(tuple, told))
    agreeing = [uv[polygon] for polygon in POLYGONS]
    mesh = read_mesh(ply(tmp_path / "c.ply", form, corner_uv=agreeing))
    np.testing.assert_array_equal(mesh.uv[1:], uv[1:])


@pytest.mark.parametrize("binary", [False, True])
def test_files_of_another_library(tmp_path: Path, binary: bool) -> None:
    mesh = trimesh.creation.torus(0.03, 0.01)
    (tmp_path / "a.ply").write_bytes(
        trimesh.exchange.ply.export_ply(mesh, encoding="binary" if binary else "ascii", vertex_normal=True)
    )
    read = read_mesh(tmp_path / "a.ply")
    np.testing.assert_allclose(read.vertices, mesh.vertices, atol=1e-7)
    np.testing.assert_array_equal(read.faces, mesh.faces)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.sampled_from(FORMATS), st.booleans(), st.data())
def test_damaged_files_are_refused_or_read_whole(tmp_path_factory, form: str, cut: bool, data) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    raw = bytearray(ply(folder / "a.ply", form).read_bytes())
    if cut:
        raw = raw[: data.draw(st.integers(0, len(raw) - 1))]
    else:
        for _ in range(data.draw(st.integers(1, 4))):
            raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    (folder / "a.ply").write_bytes(raw)
    try:
        mesh = read_mesh(folder / "a.ply")
    except InputError:
        return
    assert np.isfinite(mesh.vertices).all()
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"element vertex 13", b"element vertex 1300000000", "does not hold the 1300000000 of element 'vertex'"),
        (b"element face 11", b"element face 999999999", "does not hold the 999999999 of element 'face'"),
        (b"property float x", b"property float q", "has no vertices with x, y and z"),
        (b"property float y", b"property flaot y", r"a\.ply:8: header line not understood: 'property flaot y'"),
        (b"vertex_indices", b"vertex_numbers", "has no triangles"),
        (b"format", b"farmat", r"a\.ply:2: header line not understood"),
        (b"ply\n", b"plz\n", "is no PLY file"),
        pytest.param(
            b"ply\n",
            b"ply\ncomment " + (1 << 20) * b"a" + b"\n",
            "want a header .* of at most 1 MiB",
            id="header too long",
        ),
    ],
)
@pytest.mark.parametrize("form", FORMATS)
def test_what_is_no_ply(tmp_path: Path, form: str, old: bytes, new: bytes, says: str) -> None:
    path = ply(tmp_path / "a.ply", form)
    raw = path.read_bytes()
    assert old in raw
    path.write_bytes(raw.replace(old, new, 1))
    with pytest.raises(InputError, match=says):
        read_mesh(path)


@pytest.mark.parametrize("form", FORMATS)
def test_vertices_that_are_not_there(tmp_path: Path, form: str) -> None:
    path = ply(tmp_path / "a.ply", form, polygons=[[0, 1, 13]])
    with pytest.raises(InputError, match=r"there is no vertex 13: the file has 13, counted from 0"):
        read_mesh(path)
