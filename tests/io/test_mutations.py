"""Damaged files of every kind that is read: an ``InputError`` or a result, whatever a byte or a number became.

``python -m tests.io.test_mutations 300`` tries as many of each kind, each in a process of its own with 8 GiB and 20 s.
"""

from __future__ import annotations

import json
import random
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.finger import finger
from tests.io import fbx_text
from tests.motion import skinned_files
from warpjld.errors import WarpjldError
from warpjld.io import load_rig
from warpjld.motion.hand_file import read_hands
from warpjld.motion.load import open_motion

RIG = finger()
NAMES = ["one", "two", "three"]
_PLACES = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.05], [0.0, 0.0, -0.09]])
_NUMBERS = ("-1", "0", "1e308", "-1e39", "NaN", "2147483648", "4294967295", "1e9", "9" * 400, '""', "null", "[]", "{}")
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(\.\d+)?([eE][-+]?\d+)?(?![\w.])")


def _skinned() -> skinned_files.Skinned:
    vertices, faces = np.asarray(RIG.surface.vertices)[::1], np.asarray(RIG.surface.faces)
    nearest = np.argmin(np.abs(vertices[:, None, 2] - _PLACES[None, :, 2]), axis=1)
    joints = np.zeros((len(vertices), 4), dtype=np.uint16)
    joints[:, 0] = nearest
    weights = np.tile(np.float32([1, 0, 0, 0]), (len(vertices), 1))
    offsets = np.diff(_PLACES, axis=0, prepend=np.zeros((1, 3)))
    return skinned_files.Skinned(
        list(NAMES), [-1, 0, 1], offsets, np.tile([0.0, 0, 0, 1], (3, 1)), vertices, faces, joints, weights
    )


def _glb(path: Path) -> None:
    times = np.array([0.0, 0.1, 0.2], dtype=np.float32)
    turns = Rotation.from_euler("x", [[0.0], [-0.4], [-0.9]]).as_quat().astype(np.float32)
    skinned_files.write(path, _skinned(), {"bend": {(1, "rotation"): (times, turns, "LINEAR")}})


def _gltf(path: Path) -> None:
    import pygltflib as gl

    _glb(path.with_suffix(".glb"))
    content = gl.GLTF2().load_binary(str(path.with_suffix(".glb")))
    content.convert_buffers(gl.BufferFormat.DATAURI)
    content.save_json(str(path))


def _vrm(path: Path) -> None:
    import pygltflib as gl

    _glb(path.with_suffix(".glb"))
    content = gl.GLTF2().load_binary(str(path.with_suffix(".glb")))
    bones = {"leftHand": {"node": 0}, "leftIndexProximal": {"node": 1}, "leftIndexDistal": {"node": 2}}
    content.extensions = {"VRMC_vrm": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}}
    content.save_binary(str(path))


def _fbx(path: Path) -> None:
    what = _skinned()
    frames = what.frames()
    mesh = fbx_text.Mesh(
        "hide", what.vertices, what.faces.tolist(), what.joints[:, :1].astype(int), what.weights[:, :1]
    )
    fbx_text.Fbx(NAMES, [-1, 0, 1], frames, [mesh], stacks={"bend": np.stack([frames, frames, frames])}).write(path)


def _usda(path: Path) -> None:
    from tests.io.usd.stages import Keys, Stage

    what = _skinned()
    keys = Keys([0.0, 5.0], np.tile(what.offsets, (2, 1, 1)), np.tile(what.turns, (2, 1, 1)))
    stage = Stage(
        NAMES,
        [-1, 0, 1],
        what.frames(),
        what.vertices,
        what.faces,
        what.joints[:, :1],
        what.weights[:, :1],
        keys=[keys],
    )
    stage.write(path)


def _obj(path: Path) -> None:
    surface = RIG.surface
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}\nvt {x:.4f} {z:.4f}" for x, y, z in surface.vertices]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in np.asarray(surface.faces) + 1]
    path.write_text("\n".join(lines) + "\n")


def _joints(path: Path) -> None:
    rows = [
        {
            "name": name,
            "parent": above,
            "position": place.tolist(),
            "axis": [-1, 0, 0],
            "limits": {"flexion": [-10, 90]},
        }
        for name, above, place in zip(NAMES, [None, *NAMES], _PLACES, strict=False)
    ]
    path.write_text(json.dumps({"joints": rows}))
    _obj(path.with_name("surface.obj"))


def _map(path: Path) -> None:
    path.write_text(json.dumps({"left.index.base": "one", "left.index.knuckle2": "two", "ignore": ["three"]}))
    _glb(path.with_name("mapped.glb"))


def _bvh(path: Path) -> None:
    path.write_text(
        "HIERARCHY\nROOT LeftHandIndex1\n{\n OFFSET 0 0 0\n"
        " CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        " JOINT LeftHandIndex2\n {\n  OFFSET 0 0 -5\n  CHANNELS 3 Zrotation Xrotation Yrotation\n"
        "  End Site\n  {\n   OFFSET 0 0 -4\n  }\n }\n}\n"
        "MOTION\nFrames: 3\nFrame Time: 0.033333\n" + "0 90 0 1.5 2.5 3.5 4.5 5.5 6.5\n" * 3
    )


def _csv(path: Path) -> None:
    path.write_text("frame,index.base.flexion,index.knuckle2.flexion\n0,0,0\n5,,20\n12,40.5,60\n")


def _hand(path: Path) -> None:
    rng = np.random.default_rng(1)
    frames = [{"timestamp": 0.1 * f, "landmarks": (0.05 * rng.normal(size=(21, 3))).tolist()} for f in range(2)]
    path.write_text(json.dumps({"hand": "left", "frames": frames}))


def _rig(path: Path) -> object:
    return load_rig(path)


def _both(path: Path) -> object:
    rig = load_rig(path)
    return open_motion(path, rig)


def _moved(path: Path) -> object:
    return open_motion(path, RIG)


KINDS: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "a.glb": (_glb, _both),
    "a.gltf": (_gltf, _both),
    "a.vrm": (_vrm, _rig),
    "a.fbx": (_fbx, _both),
    "a.usda": (_usda, _both),
    "a.obj": (_obj, lambda path: load_rig(path, skeleton=path.with_name("joints.json"))),
    "joints.json": (_joints, lambda path: load_rig(path.with_name("surface.obj"), skeleton=path)),
    "map.json": (_map, lambda path: load_rig(path.with_name("mapped.glb"), joint_map=path)),
    "a.bvh": (_bvh, _moved),
    "a.csv": (_csv, _moved),
    "hand.json": (_hand, read_hands),
}
"""How a sound file of each kind is written, and what reads it."""


def mutated(data: bytes, draw: random.Random) -> bytes:
    """Damage: bits, a piece lost or doubled, an end cut off, numbers that are none, brackets without end."""
    kind = draw.choice(("bits", "bits", "cut", "lost", "doubled", "number", "number", "number", "deep"))
    at = draw.randrange(len(data))
    if kind == "bits":
        out = bytearray(data)
        for _ in range(draw.choice((1, 3, 20))):
            out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
        return bytes(out)
    if kind == "cut":
        return data[:at]
    if kind == "lost":
        return data[:at] + data[at + draw.choice((1, 4, 50)) :]
    if kind == "doubled":
        end = at + draw.choice((1, 4, 50, 1000))
        return data[:end] + data[at:end] + data[end:]
    numbers = [match.span() for match in _NUMBER.finditer(data)]
    begin, end = draw.choice(numbers) if numbers else (at, at + 4)
    new = draw.choice(("[", "{", '{"a":')) * 100_000 if kind == "deep" else draw.choice(_NUMBERS)
    if data[:4] == b"glTF":  # the chunk's length stays
        old = data[begin:end]
        return data[:begin] + new.encode()[: len(old)].ljust(len(old)) + data[end:]
    return data[:begin] + new.encode() + data[end:]


def tried(name: str, path: Path, content: bytes) -> str:
    """Write a file and read it; empty, or what went wrong."""
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = KINDS[name][1](path)
        except WarpjldError as error:
            return "" if "\n" not in str(error) else f"two lines: {error}"
        except Exception:
            return traceback.format_exc()
    poses = getattr(result, "poses", None)
    if poses is not None and not (np.isfinite(poses.positions).all() and np.isfinite(poses.rotations).all()):
        return "poses that are not finite"
    skeleton = getattr(result, "skeleton", None)
    if skeleton is not None and not np.isfinite(skeleton.rest).all():
        return "joints that are not finite"
    return ""


def sound(name: str, folder: Path) -> Path:
    """A sound file."""
    path = folder / name
    if name == "a.obj":
        _joints(folder / "joints.json")
    KINDS[name][0](path)
    return path


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_are_errors_of_one_line(name: str, tmp_path: Path) -> None:
    path = sound(name, tmp_path)
    data = path.read_bytes()
    KINDS[name][1](path)
    for n in range(12):
        told = tried(name, path, mutated(data, random.Random(f"{name} {n}")))
        assert not told, f"damage {n}: {told}"


def _many(count: int, only: list[str]) -> None:  # pragma: no cover
    import os
    import resource

    folder = Path(tempfile.mkdtemp())
    for name in only or KINDS:
        path = sound(name, folder)
        data = path.read_bytes()
        KINDS[name][1](path)
        for n in range(count):
            told_file = folder / "told"
            told_file.unlink(missing_ok=True)
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
                signal.alarm(20)
                told_file.write_text(tried(name, path, mutated(data, random.Random(f"{name} {n}"))))
                os._exit(0)
            _, ended = os.waitpid(child, 0)
            told = told_file.read_text() if told_file.exists() else ""
            if ended or told:
                (folder / f"{n}-{name}").write_bytes(path.read_bytes())
                last = told.strip().splitlines()[-3:]
                print(f"{folder}/{n}-{name}: ended {ended}: {' | '.join(last)}", flush=True)
        print(name, "done", flush=True)


if __name__ == "__main__":
    _many(int(sys.argv[1]), sys.argv[2:])
