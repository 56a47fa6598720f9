"""Text and JSON files that people write, and what is said of those that are none."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.files.text_file import read_json, read_text


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b'\xef\xbb\xbf{"a": "\xc2\xb5"}')
    assert read_text(tmp_path / "a.json") == '{"a": "µ"}'
    assert read_json(tmp_path / "a.json") == {"a": "µ"}


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"{} \xe9", r"a\.json: is not UTF-8 text \(byte 3\)"),
        (b'{"a":\n 1 1}', r"a\.json:2:4: is not JSON"),
        (b"[" * 100_000, r"a\.json: JSON: 100,000 levels; the limit is 200 \(raise it by"),
    ],
)
def test_what_is_no_json(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_json(tmp_path / "a.json")


def test_integers_of_endless_digits_are_infinite(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(f"[-7, {2**70}, -{'9' * 400}, {'9' * 5000}]")
    assert read_json(tmp_path / "a.json") == [-7, 2.0**70, float("-inf"), float("inf")]


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.txt: cannot be read: No such file"):
        read_text(tmp_path / "none.txt")
    with pytest.raises(InputError, match="is a folder; want a file"):
        read_text(tmp_path)


EDITORS = {
    "as it is": lambda text: text.encode(),
    "byte order mark": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "Windows": lambda text: b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode(),
    "old Macintosh": lambda text: text.replace("\n", "\r").encode(),
    "tabs": lambda text: text.replace("  ", "\t").encode(),
    "PowerShell": lambda text: text.replace("\n", "\r\n").encode("utf-16"),
    "big-endian": lambda text: b"\xfe\xff" + text.encode("utf-16-be"),
}

SKELETON = """{
  "joints": [
    {"name": "a", "parent": null, "position": [0, 0, 0]},
    {"name": "b", "parent": "a", "position": [0, 0, -0.1]},
    {"name": "c", "parent": "b", "position": [0, 0, -0.2]}
  ]
}
"""


@pytest.mark.parametrize("editor", EDITORS)
def test_every_kind_of_text_from_any_editor(tmp_path: Path, hands, editor: str) -> None:
    """Skeletons, joint maps, parameters, study plans, scripts and key angles read the same."""
    from warpjld.covering.parameters import default_parameters, load_parameters, save_parameters
    from warpjld.io.joint_map_file import read_joint_map
    from warpjld.io.mesh_file import read_mesh
    from warpjld.io.skeleton_file import read_skeleton_file
    from warpjld.motion.csv_file import read_csv
    from warpjld.script import Interpreter, Scene
    from warpjld.study.grasping import load_plan

    def write(name: str, text: str) -> Path:
        (tmp_path / name).write_bytes(EDITORS[editor](text))
        return tmp_path / name

    triangle = write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1  2  3\n")
    tree = read_skeleton_file(write("a.json", SKELETON), read_mesh(triangle)).tree
    assert tree.names == ("a", "b", "c")
    assert tree.positions[2, 2] == -0.2
    mapped = write("map.json", '{\n  "left.knee": "Müller",\n  "ignore": ["x"]\n}\n')
    assert read_joint_map(mapped) == {"left.knee": "Müller", "ignore": ["x"]}
    skeleton = hands["left"].skeleton
    save_parameters(tmp_path / "p.json", skeleton, default_parameters(skeleton))
    written = write("p.json", (tmp_path / "p.json").read_text("utf-8"))
    for field in fields(read := load_parameters(written, skeleton)):
        want = getattr(default_parameters(skeleton), field.name)
        np.testing.assert_allclose(getattr(read, field.name), want, atol=1e-6)
    plan = 'seed = 5\ntrials = 4\n[[hands]]\nname = "Händ"\nbuiltin = "left"\n[[objects]]\nbuiltin = "ball"\n'
    assert load_plan(write("a.toml", plan)).hands[0].name == "Händ"
    scene = Scene()
    scene.add("left", hands["left"])
    script = write("a.jld", "# Größe\nFINGER1  LEFT  INDEX  FLEXION  AT  0  20  # bent\n\nOBJECT  b  BALL  0.1\n")
    Interpreter(scene).run_file(script)
    assert scene.actor().motion.value("left.index.base.flexion", 0) == pytest.approx(0.349066, abs=1e-6)
    assert list(scene.props) == ["B"]
    keys = read_csv(write("a.csv", "frame,left.index.base.flexion\n0,0\n10,45\n"), skeleton=skeleton)
    assert keys.value("left.index.base.flexion", 10) == pytest.approx(np.radians(45))
