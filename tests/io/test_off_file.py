"""OFF: polygons of any shape, text of any editor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp import load_object
from warpjld.io.mesh_file import read_mesh

OUTLINE = [(60, 0), (60, 20), (20, 20), (20, 60), (0, 60), (0, 0)]  # an L, area 2,000, border 240
POINTS = [(1, 2, 3), *((x, 0, z) for x, z in OUTLINE), *((x, 30, z) for x, z in OUTLINE)]
SIDES = [(1 + i, 7 + i, 7 + (i + 1) % 6, 1 + (i + 1) % 6) for i in range(6)]
POLYGONS = [tuple(range(1, 7)), tuple(range(12, 6, -1)), *SIDES]
BODY = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS) + "".join(
    f"{len(p)} " + " ".join(map(str, p)) + "\n" for p in POLYGONS
)
OFF = f"OFF\n13 8 0\n{BODY}"


@pytest.mark.parametrize(
    "content",
    [
        OFF.encode(),
        f"OFF 13 8 0\n{BODY}".encode(),
        b"\xef\xbb\xbf# made here\r\n" + OFF.replace("\n", " # behind\r\n").replace(" ", "\t").encode(),
        OFF.replace("OFF\n", "COFF\n").replace("\n6 ", " 255 0 0 255\n6 ", 1).encode(),
        (OFF.rstrip() + " 0.5 0.5 0.5").encode(),
    ],
)
def test_concave_polygons_and_the_files_order(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.off").write_bytes(content)
    mesh = read_mesh(tmp_path / "a.off")
    np.testing.assert_array_equal(mesh.vertices, np.array(POINTS, float))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(11_200)
    assert load_object(tmp_path / "a.off").volume == pytest.approx(60_000)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is no OFF file in text"),
        ("OFF BINARY\n", "is no OFF file in text"),
        ("OFF\n", "want the numbers of vertices and faces"),
        (OFF.replace("13 8", "13 900000000"), "announces 13 vertices and 900000000 faces, but has 21 lines"),
        (OFF.replace("1 2 3\n", "1 2\n"), r"a\.off:3: want 3 numbers, got '1 2'"),
        (OFF.replace("6 1 2 3", "6 1 2 13"), r"a\.off:16: want a number of corners, then as many of the vertices 0…12"),
        (OFF.replace("6 1 2 3", "9 1 2 3"), r"a\.off:16: want a number of corners"),
        (OFF.replace("6 1 2 3", "x 1 2 3"), r"a\.off:16: want a number of corners"),
        (OFF.replace("1 2 3\n", "1 2 nan\n"), "vertex 0 is not finite"),
    ],
)
def test_what_is_no_off(tmp_path: Path, content: str, says: str) -> None:
    (tmp_path / "a.off").write_text(content)
    with pytest.raises(InputError, match=says):
        read_mesh(tmp_path / "a.off")
