"""OBJ as it stands in the file: order and number of its vertices, polygons of any shape, text of any editor."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.covering import bind
from warpjld.errors import InputError
from warpjld.grasp import load_object
from warpjld.io import load_rig
from warpjld.io.caches import open_cache
from warpjld.io.mesh_file import read_mesh
from warpjld.skeleton import poses_from_angles

FAULTS = Path(__file__).resolve().parents[3] / "shared" / "faults"

BOX = """v -30 -30 -30
v 30 -30 -30
v 30 30 -30
v -30 30 -30
v -30 -30 30
v 30 -30 30
v 30 30 30
v -30 30 30
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""

# an L, 60 by 60 with legs 20 wide, 30 high: two faces of 2,000 and a border of 240
L_SHAPE = """v 60 0 0
v 60 0 20
v 20 0 20
v 20 0 60
v 0 0 60
v 0 0 0
v 60 30 0
v 60 30 20
v 20 30 20
v 20 30 60
v 0 30 60
v 0 30 0
f 1 2 3 4 5 6
f 12 11 10 9 8 7
f 1 7 8 2
f 2 8 9 3
f 3 9 10 4
f 4 10 11 5
f 5 11 12 6
f 6 12 7 1
"""


def obj(folder: Path, text: str | bytes, name: str = "a.obj") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.fixture
def faults() -> Path:
    if not FAULTS.is_dir():
        pytest.skip("files that went wrong (../shared/faults) are not here")
    return FAULTS


FORMS = {
    "plain": BOX.encode(),
    "byte order mark": b"\xef\xbb\xbf" + BOX.encode(),
    "UTF-16": BOX.encode("utf-16"),
    "tabs": BOX.replace(" ", "\t").encode(),
    "tabs and blanks": BOX.replace(" ", " \t ").replace("\n", "\t \n").encode(),
    "comments": ("# head\n" + BOX.replace("\n", " # behind\n").replace("30 #", "30# at once:")).encode(),
    "CRLF": BOX.replace("\n", "\r\n").encode(),
    "CR": BOX.replace("\n", "\r").encode(),
    "no last newline": BOX.rstrip().encode(),
    "indented": BOX.replace("v ", "  v ").replace("f ", "\tf ").encode(),
    "continued": BOX.replace("f 1 4 3 2", "f 1 4 \\\n3\\\r\n 2").encode(),
    "Windows paths": b"# C:\\models\\\nmtllib C:\\m\\\n" + BOX.encode(),
    "other encodings": b"o M\xfcller \xff\n" + BOX.encode(),
    "colours, w": BOX.replace("30\nv", "30 0.5 0.5 0.5\nv").encode(),
    "normals and materials": b"mtllib none.mtl\nusemtl a\nvn 0 0 1\nvp 1\ns off\nl 1 2\np 1\n"
    + BOX.replace("f 1 4 3 2", "usemtl b\ng side\nf 1//1 4//1 3//1 2//1").encode(),
    "exponents": BOX.replace("30", "3.0e+1").encode(),
    "fo": BOX.replace("f ", "fo ").encode(),
}


@pytest.mark.parametrize("form", FORMS)
def test_text_of_any_editor(tmp_path: Path, form: str) -> None:
    mesh = read_mesh(obj(tmp_path, FORMS[form]))
    np.testing.assert_array_equal(mesh.vertices, np.array([line.split()[1:] for line in BOX.splitlines()[:8]], float))
    assert area(mesh.vertices, mesh.faces) == pytest.approx(21_600)
    assert len(mesh.faces) == 12
    assert load_object(tmp_path / "a.obj").volume == pytest.approx(216_000)


@pytest.mark.parametrize("name", ["bom", "comment", "tab"])
def test_text_that_went_wrong(faults: Path, name: str) -> None:
    mesh = read_mesh(faults / "obj_text" / f"{name}.obj")
    assert len(mesh.vertices) == 8
    assert area(mesh.vertices, mesh.faces) == pytest.approx(21_600)


@pytest.mark.parametrize("name", ["plain", "uv", "mat"])
def test_a_tube_keeps_its_lines(faults: Path, tmp_path: Path, name: str) -> None:
    """The point cache has the positions of the plain tube in the order of the file's lines."""
    path = faults / "obj_order" / f"tube_{name}.obj"
    rig = load_rig(path, skeleton=faults / "obj_order" / "tube.json")
    lines = [line.split()[1:] for line in path.read_text().splitlines() if line.startswith("v ")]
    own = np.array(lines, float)
    rest = rig.surface.to_source(rig.surface.vertices)
    assert rest.shape == own.shape == (374, 3)
    np.testing.assert_allclose(rest, own * np.linalg.norm(rest[0]) / np.linalg.norm(own[0]), atol=1e-9)
    write(rig.surface, tmp_path / "a.pc2")
    np.testing.assert_allclose(points(tmp_path / "a.pc2", 374)[0], rest, atol=1e-7)
    kept = [line for line in (tmp_path / "a.rest.obj").read_text().splitlines() if line.startswith("v ")]
    assert len(kept) == 374


def write(surface, path: Path) -> None:
    with open_cache(path, surface, frames=1, rate=25) as cache:
        cache.write(surface.vertices[None].astype(np.float32))


def points(path: Path, count: int) -> np.ndarray:
    return np.frombuffer(path.read_bytes()[32:], "<f4").reshape(-1, count, 3)


def tube(folder: Path, *, unused: int = 0, split: bool = False) -> tuple[Path, list[int]]:
    """A tube of 12 rings of 8 vertices; some lines that no face uses among them, and one column twice.

    Returns:
        The file, and the numbers of the lines in use.
    """
    around = 9 if split else 8
    ring = [[0.02 * np.cos(np.pi * a / 4), 0.02 * np.sin(np.pi * a / 4)] for a in range(around)]
    rows = [[x, y, -0.03 * r] for r in range(12) for x, y in ring]
    where = np.arange(len(rows))
    extra = np.random.default_rng(2).choice(len(rows), unused, replace=False)
    place = where + np.array([(extra <= i).sum() for i in where], dtype=int)
    lines = np.random.default_rng(3).uniform(-0.02, 0.02, (len(rows) + unused, 3))
    lines[place] = rows
    text = "".join(f"v {x:.7f} {y:.7f} {z:.7f}\n" for x, y, z in lines)
    for r in range(11):
        for a in range(8):
            b = a + 1 if split else (a + 1) % 8
            four = [r * around + a, (r + 1) * around + a, (r + 1) * around + b, r * around + b]
            text += "f " + " ".join(str(1 + place[i]) for i in four) + "\n"
    joints = [
        {"name": name, "parent": above, "position": [0, 0, z]}
        for name, above, z in (("a", None, 0), ("b", "a", -0.11), ("c", "b", -0.22), ("d", "c", -0.33))
    ]
    (folder / "tube.json").write_text(json.dumps({"joints": joints}))
    return obj(folder, text, "tube.obj"), place.tolist()


@pytest.mark.parametrize(("unused", "split"), [(0, True), (5, False), (7, True)])
def test_unused_and_split_vertices_stay(tmp_path: Path, unused: int, split: bool) -> None:
    """What the faces use moves as it does without the others, in the order of the lines; the rest is finite."""
    plain, _ = tube(tmp_path)
    rig = load_rig(plain, skeleton=tmp_path / "tube.json", unit="m")
    with_all, place = tube(tmp_path, unused=unused, split=split)
    other = load_rig(with_all, skeleton=tmp_path / "tube.json", unit="m")
    angles = np.zeros((1, len(rig.skeleton), 4))
    angles[0, [1, 2], 0] = np.radians([40, 30])
    want = rig.surface.to_source(bind(rig.skeleton, rig.surface).deform(poses_from_angles(rig.skeleton, angles)))[0]
    moved = bind(other.skeleton, other.surface).deform(poses_from_angles(other.skeleton, angles))
    got = other.surface.to_source(moved)[0]
    assert len(got) == len(place) + unused
    assert np.isfinite(got).all()
    around = 9 if split else 8
    column = np.arange(len(place)) % around % 8 + 8 * (np.arange(len(place)) // around)
    np.testing.assert_allclose(got[place], want[column], atol=1e-6)


def test_a_stray_vertex_far_away_welds_nothing(tmp_path: Path) -> None:
    """A box of 60 units beside a vertex that no face uses, a million times as far."""
    path = obj(tmp_path, BOX.replace("f 1 4", "v 6e7 0 6e9\nf 1 4"))
    thing = load_object(path, unit="mm")
    assert len(thing.vertices) == 8
    assert thing.volume * 1e9 == pytest.approx(216_000)
    np.testing.assert_allclose(thing.size, 0.06)


def test_concave_polygons(tmp_path: Path) -> None:
    path = obj(tmp_path, L_SHAPE)
    mesh = read_mesh(path)
    assert area(mesh.vertices, mesh.faces) == pytest.approx(11_200)
    thing = load_object(path)
    assert area(thing.vertices, thing.faces) == pytest.approx(11_200)
    assert thing.volume == pytest.approx(2_000 * 30)
    assert thing.report.watertight
    assert thing.report.solid


@pytest.mark.parametrize("name", ["concave2", "conc_ok"])
def test_concave_polygons_that_went_wrong(faults: Path, name: str) -> None:
    thing = load_object(faults / "concave" / f"{name}.obj", unit="mm")
    assert area(thing.vertices, thing.faces) * 1e6 == pytest.approx(11_200)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(3, 9), st.integers(0, 3), st.randoms(use_true_random=False))
def test_negative_indices_count_from_the_last_so_far(tmp_path_factory, sides: int, between: int, random) -> None:
    """Polygons with vertices before and between them: the same numbered from the front and from behind."""
    folder = tmp_path_factory.mktemp("negative")
    front, behind, total = "", "", 0
    for polygon in range(4):
        block = "".join(
            f"v {np.cos(2 * np.pi * i / sides):.6f} {np.sin(2 * np.pi * i / sides):.6f} {polygon}\n"
            f"vt {random.random():.6f} {random.random():.6f}\n"
            for i in range(sides)
        ) + "".join(f"v 0 0 {random.random():.4f}\nvt 0 0\n" for _ in range(between))
        total += sides + between
        numbers = range(total - between - sides + 1, total - between + 1)
        front += block + "f " + " ".join(f"{i}/{i}" for i in numbers) + "\n"
        behind += block + "f " + " ".join(f"{i - total - 1}/{i - total - 1}" for i in numbers) + "\n"
    one, other = read_mesh(obj(folder, front)), read_mesh(obj(folder, behind, "b.obj"))
    np.testing.assert_array_equal(one.faces, other.faces)
    np.testing.assert_array_equal(one.uv, other.uv)
    assert len(one.vertices) == 4 * (sides + between)


def test_corners_without_texture_are_told(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0.5 0.25\nvt 0.75 1\nvt 1\nf 1/1 2/2 3/3\nf 2 4 3\n"
    mesh = read_mesh(obj(tmp_path, text))
    np.testing.assert_array_equal(mesh.corner_uv, [[[0.5, 0.25], [0.75, 1], [1, 0]], np.zeros((3, 2))])
    assert mesh.notes == ("3 corners have no texture coordinates: 0, 0",)


def test_objects_with_vertices_of_their_own_are_parts(tmp_path: Path) -> None:
    shifted = "".join(
        "f " + " ".join(str(int(i) + 9) for i in line.split()[1:]) if line[0] == "f" else line
        for line in BOX.splitlines(keepends=True)
        if line.strip()
    ).replace("f", "\nf")
    two = f"o hand\ng a\n{BOX}v 5 5 5\no nails one\n{shifted}\n"
    parts = read_mesh(obj(tmp_path, two)).parts
    assert [(p.name, p.vertices, p.faces) for p in parts] == [
        ("hand", slice(0, 9), slice(0, 12)),
        ("nails one", slice(9, 17), slice(12, 24)),
    ]
    shared = BOX.replace("f 4 1", "o lid\nf 4 1")
    (part,) = read_mesh(obj(tmp_path, shared, "shared.obj")).parts
    assert (part.name, part.vertices, part.faces) == ("shared", slice(0, 8), slice(0, 12))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (BOX + "f 1 2 9\n", r"a\.obj:15: there is no vertex 9: the file has 8"),
        (BOX + "f 0 1 2\n", r"a\.obj:15: '0': indices count from 1, or from -1 backwards"),
        (BOX + "f -9 1 2\n", r"a\.obj:15: '-9': indices count from 1"),
        (BOX + "f 1/1 2/1 3/1\n", r"a\.obj:15: there is no vt 1: the file has 0"),
        (BOX + "f 1 2 x\n", r"a\.obj:15: want corners as 1, 1/1, 1//1 or 1/1/1, got 'x'"),
        (BOX + f"f 1 2 {'9' * 30}\n", r"a\.obj:15: '9+': there is no such vertex"),
        (BOX + f"f 1 2 {'9' * 5000}\n", r"a\.obj:15: '9{40}': there is no such vertex"),
        (BOX.replace("v 30 -30 30", "v 30 -30"), r"a\.obj:6: want 3 numbers, got '30 -30'"),
        (BOX.replace("v 30 -30 30", "v 30,5 -30 30"), r"a\.obj:6: want 3 numbers, got '30,5 -30 30'"),
        (BOX.replace("v 30 -30 30", "v 30 nan 30"), r"a\.obj:6: want finite numbers, got '30 nan 30'"),
        (BOX.replace("v 30 -30 30", "v 30 1e999 30"), r"a\.obj:6: want finite numbers"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", r"a\.obj: has no triangles"),
        ("", r"a\.obj: has no triangles"),
        (b"\0\1\2\xff" * 50, r"a\.obj: has no triangles"),
    ],
)
def test_what_is_no_obj(tmp_path: Path, text: str | bytes, says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_mesh(obj(tmp_path, text))
