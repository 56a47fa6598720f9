"""Skeletons of twenty thousand joints are refused before anything is made of them, whatever file they come in."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.finger import finger
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion.load import load_motion

_MANY = 20_000


def _gltf(path: Path, animated: bool = False) -> None:
    nodes = [{"name": f"j{k}", "children": [k + 1] if k + 1 < _MANY else []} for k in range(_MANY)]
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    content: dict[str, object] = {"asset": {"version": "2.0"}, "nodes": nodes}
    content |= {"animations": [{"channels": [channel], "samplers": [{"input": 0, "output": 1}]}]} if animated else {}
    content |= {} if animated else {"skins": [{"joints": list(range(_MANY))}]}
    path.write_text(json.dumps(content))


def _json(path: Path) -> None:
    names = [f"j{k}" for k in range(_MANY)]
    rows = [
        {"name": name, "parent": up, "position": [0, 0, 0]} for name, up in zip(names, [None, *names], strict=False)
    ]
    path.write_text(json.dumps({"joints": rows}))
    path.with_name("a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")


def _bvh(path: Path) -> None:
    rows = ["HIERARCHY", "ROOT j0", "{", "OFFSET 0 0 0", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    for k in range(1, _MANY):
        rows += [f"JOINT j{k}", "{", "OFFSET 0 0 -1", "CHANNELS 3 Zrotation Xrotation Yrotation"]
    rows += ["}"] * _MANY + ["MOTION", "Frames: 1", "Frame Time: 0.03333", " ".join(["0"] * 3 * _MANY)]
    path.write_text("\n".join(rows))


CASES: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "rig.gltf": (_gltf, load_rig),
    "clip.gltf": (lambda path: _gltf(path, True), lambda path: load_motion(path, finger())),
    "clip.bvh": (_bvh, lambda path: load_motion(path, finger())),
    "joints.json": (_json, lambda path: load_rig(path.with_name("a.obj"), skeleton=path)),
}


@pytest.mark.parametrize("name", CASES)
def test_they_are_refused_soon(name: str, tmp_path: Path) -> None:
    write, read = CASES[name]
    write(tmp_path / name)
    begin = time.process_time()
    with pytest.raises(InputError, match="joints; the limit is 1,024"):
        read(tmp_path / name)
    assert time.process_time() - begin < 3.0  # a second on a quiet core; before, half a minute
