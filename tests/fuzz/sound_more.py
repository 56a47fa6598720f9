"""Sound files of what others write and of what runs leave behind, and what reads each: see ``tests.fuzz.sound``."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import click
import numpy as np

from tests.finger import finger
from warpjld.batch.record import FOLDER, ClipRecord, read_record, still_there, write_record
from warpjld.cli import command_group
from warpjld.covering import bind_rig
from warpjld.covering.kept import load_binding, save_binding
from warpjld.errors import InputError
from warpjld.io.mesh_file import read_mesh
from warpjld.io.points_file import read_points_file, write_points_file
from warpjld.motion.animations import animation_names
from warpjld.rig import Rig
from warpjld.script.pose_files import load_pose
from warpjld.skeleton import poses_from_angles
from warpjld.skeleton.actor_points import point_set
from warpjld.skeleton.hand import hand_joint_names
from warpjld.study.scoring.joint_names import read_joint_names
from warpjld.study.scoring.read import read_grasps
from warpjld.study.scoring.reading_grasps import GraspReading

__all__ = ["MORE"]

RIG = finger()


@cache
def _hand() -> Rig:
    from warpjld.hand.kept import kept_hand

    return kept_hand("right", resolution=1500)


def _binding(path: Path) -> None:
    save_binding(path, bind_rig(RIG), RIG)


def _bound(path: Path) -> object:
    """Positions that a surface takes by a stored binding, shape (2, V, 3)."""
    angles = np.zeros((2, len(RIG.skeleton), 4))
    angles[1, :, 0] = 0.3
    covering = load_binding(path, RIG)
    return covering.deform(poses_from_angles(RIG.skeleton, angles), threads=1)


def _points(path: Path) -> None:
    rng = np.random.default_rng(4)
    names = point_set(hand_joint_names("left"))
    write_points_file(path, {name: 0.05 * rng.normal(size=3) for name in names})
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in RIG.surface.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in np.asarray(RIG.surface.faces) + 1]
    path.with_name("points.obj").write_text("\n".join(lines) + "\n")


def _pointed(path: Path) -> object:
    read_points_file(path, read_mesh(path.with_name("points.obj")))
    return None


def _pose(path: Path) -> None:
    path.write_text(json.dumps({"pose": "x", "angles": {"index.base.flexion": 84, "thumb.knuckle2.flexion": 12.5}}))


def _posed(path: Path) -> object:
    return np.array(list(load_pose(path).values()))


def _isaac(path: Path) -> None:
    path.write_text(
        "format: isaac_grasp\nformat_version: 1.0\nobject_frame_link: /World/mug\ngripper_frame_link: /World/hand\n"
        "warpjld: {hand: right, scale: 1.0, mass: 0.2, friction: {grasp_0: 0.5}}\n"
        "grasps:\n  grasp_0:\n    confidence: 1.0\n    position: [0.01, 0.02, 1e-3]\n"
        "    orientation: {w: 0.70710678, xyz: [0.0, 0.70710678, 0.0]}\n"
        "    cspace_position:\n      index.base.flexion: 0.5\n    pregrasp_cspace_position: {}\n"
    )


def _rows(path: Path) -> None:
    head = "name,hand,object,x,y,z,qw,qx,qy,qz,index.base.flexion,scale,friction,mass\n"
    path.write_text(head + "a,right,ball,0,0,0.1,1,0,0,0,90,2,0.5,0.1\nb,right,ball,0,0,0.1,1,0,0,0,,1,0.5,0.1\n")


def _array(path: Path) -> None:
    hand = {"trans": np.zeros((2, 3)), "rot": np.zeros((2, 3)), "pose": np.zeros((2, 45)), "flat_hand_mean": True}
    thing = {"trans": np.full((2, 3), 0.5), "rot": np.zeros((2, 3)), "angle": np.zeros(2)}
    np.save(path, np.array({"right_hand": hand, "mug": thing}, dtype=object))


def _joints(path: Path) -> None:
    one = {"channel": "index.base.abduction", "factor": -1, "offset": 5}
    frame = {"position": [0, 0, 0.1], "rotation": [0, 1, 0, 0]}
    joints = {"J1": one, "J2": "thumb.base.flexion", "J0": None}
    path.write_text(json.dumps({"joints": joints, "order": ["J0", "J1", "J2"], "hand_frame": frame}))


def _grasps(path: Path) -> object:
    found = read_grasps(path, GraspReading(lambda name: _hand()))
    return np.array([[*grasp.position, *grasp.rotation] for grasp in found])


def _record(path: Path) -> None:
    motion = path.with_name("clip.csv")
    motion.write_text("frame,index.base.flexion\n0,0\n")
    files = {motion.name: "0" * 64}
    write_record(path.parent, ClipRecord("clip", str(motion), "0" * 64, None, "done", frames=1, rate=30.0, files=files))
    path.write_bytes((path.parent / FOLDER / "clip.json").read_bytes())


def _recorded(path: Path) -> object:
    kept = path.parent / FOLDER / "clip.json"
    kept.parent.mkdir(exist_ok=True)
    kept.write_bytes(path.read_bytes())
    record = read_record(path.parent, "clip")
    return None if record is None else still_there(path.parent, record)


def _arguments(path: Path) -> None:
    from tests.fuzz.sound import KINDS

    KINDS["a.glb"][0](path.with_name("rig.glb"))
    rig = motion = "rig.glb"
    lines = [
        ["--limit", "frames=1000", "deform", rig, "--motion", motion, "-o", "o.npz", "--frames", "0:1", "--rate", "30"],
        ["inspect", rig, "--unit", "m", "--up", "y", "--side", "left", "--scale", "1", "--json", "--no-picture"],
    ]
    path.write_text(json.dumps(lines))


_LINES = 8
"""Command lines that are called of a file: damage repeats entries, and each may take as long as an input."""


def _called(path: Path) -> object:
    """The command line with these arguments, in the file's folder."""
    try:
        lines = json.loads(path.read_text(errors="surrogatepass"))
    except (ValueError, RecursionError):
        raise InputError("no arguments") from None
    if not (isinstance(lines, list) and all(isinstance(line, list) for line in lines)):
        raise InputError("no arguments")
    before = Path.cwd()
    os.chdir(path.parent)
    limits = {name: value for name, value in os.environ.items() if name.startswith("WARPJLD_LIMIT")}
    try:
        for line in lines[:_LINES]:
            texts = [str(one).replace("\0", "?") for one in line]  # no shell passes zero bytes
            command_group.main(texts, prog_name="warpjld", standalone_mode=False)
    except (click.ClickException, click.exceptions.Exit, click.Abort, OSError) as error:  # as the program tells them
        raise InputError(str(error)[:200]) from None
    finally:
        os.chdir(before)
        for name in [name for name in os.environ if name.startswith("WARPJLD_LIMIT")]:
            del os.environ[name]
        os.environ |= limits
    return None


def _usdc(path: Path) -> None:
    from pxr import Usd

    from tests.fuzz.sound import KINDS

    KINDS["a.usda"][0](path.with_suffix(".usda"))
    stage = Usd.Stage.Open(str(path.with_suffix(".usda")))
    stage.Export(str(path))


def _usd(path: Path) -> object:
    from tests.fuzz.sound import KINDS

    return KINDS["a.usda"][1](path)


def _vrma(path: Path) -> None:
    import pygltflib as gl

    from tests.fuzz.sound import KINDS

    KINDS["a.glb"][0](path.with_suffix(".glb"))
    content = gl.GLTF2().load_binary(str(path.with_suffix(".glb")))
    bones = {"leftHand": {"node": 0}, "leftIndexProximal": {"node": 1}, "leftIndexDistal": {"node": 2}}
    content.extensions = {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}}
    content.save_binary(str(path))


def _played(path: Path) -> object:
    from warpjld.motion.load import load_motion

    animation_names(path)
    return load_motion(path, RIG)


MORE: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "binding.npz": (_binding, _bound),
    "points.json": (_points, _pointed),
    "pose.json": (_pose, _posed),
    "grasps.yaml": (_isaac, _grasps),
    "grasps.csv": (_rows, _grasps),
    "grasps.npy": (_array, _grasps),
    "names.json": (_joints, read_joint_names),
    "record.json": (_record, _recorded),
    "a.usdc": (_usdc, _usd),
    "a.vrma": (_vrma, _played),
    "command-line.json": (_arguments, _called),
}
"""How a sound file of each kind is written, and what reads it."""
