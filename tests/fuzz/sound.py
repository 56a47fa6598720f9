"""Sound files of every kind that is read, made in code, and what reads each: where damage begins."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.finger import finger
from tests.fuzz.sound_more import MORE
from tests.fuzz.sound_packed import PACKED
from tests.fuzz.sound_state import read_state, write_state
from tests.io import fbx_text
from tests.motion import skinned_files
from warpjld.covering import bind_rig, default_parameters, load_parameters, save_parameters
from warpjld.fem.study.study_file import load_study
from warpjld.grasp.keyframes import load_keyframes
from warpjld.grasp.object_file import load_object
from warpjld.io import load_rig
from warpjld.motion.hand_file import read_hands
from warpjld.motion.load import load_motion
from warpjld.motion.target_file import read_targets
from warpjld.script import Interpreter, Scene
from warpjld.script.runner import run_scene
from warpjld.script.staging import frame_numbers, stage
from warpjld.skeleton import poses_from_angles
from warpjld.study.grasping import load_plan
from warpjld.study.run import opened
from warpjld.study.shards import Shard, Shards
from warpjld.tables.columns import Column

RIG = finger()
NAMES = ["one", "two", "three"]
_PLACES = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.05], [0.0, 0.0, -0.09]])


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
    return load_motion(path, rig)


def _moved(path: Path) -> object:
    return load_motion(path, RIG)


def _object(path: Path) -> object:
    return load_object(path)


def _shape(kind: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import trimesh

        trimesh.creation.box((0.05, 0.06, 0.07)).export(path, file_type=kind)

    return write


def _bag(path: Path) -> None:
    import trimesh

    box = trimesh.creation.box((0.05, 0.06, 0.07))
    shapes = np.stack([box.vertices, 1.1 * box.vertices])
    np.savez(path, vertices=shapes, faces=box.faces, frames=np.array([0, 10]))


def _mano(path: Path) -> None:
    rng = np.random.default_rng(2)
    pose = 0.1 * rng.normal(size=(3, 45))
    np.savez(path, hand_pose=pose, global_orient=np.zeros((3, 3)), transl=np.zeros((3, 3)), flat_hand_mean=True, fps=30)


def _landmarks(path: Path) -> None:
    from tests.motion.hand_files import camera_landmarks, postures
    from tests.motion.skeletons import hand

    skeleton = hand("left")
    np.save(path, camera_landmarks(skeleton, "left", postures(skeleton, "left", ("flat", "fist", "point"))))


def _recording(kind: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        from tests.motion.test_broken_recordings import recordings

        path.write_text(json.dumps(recordings()[kind]))

    return write


def _held_hand(path: Path) -> object:
    from tests.motion.skeletons import hand, rig

    return load_motion(path, rig(hand("left")))


def _parameters(path: Path) -> None:
    save_parameters(path, RIG.skeleton, default_parameters(RIG.skeleton))


def _targets(path: Path) -> None:
    still = np.stack([RIG.surface.to_source(RIG.surface.vertices.astype(np.float32))] * 2)
    np.savez(path, vertices=still, channels=np.array(["index.base.flexion"]), angles=np.array([[0.0], [20.0]]))


def _plan(path: Path) -> None:
    path.write_text(
        'title = "Two hands"\nseed = 2\ntrials = 6\nfriction = [0.4, 0.6]\nscales = [0.9, 1.1]\n'
        'digits = ["thumb", "index"]\n'
        '[[hands]]\nname = "small"\nbuiltin = "right"\npercentile = 5\nsex = "female"\nresolution = 1500\n'
        '[[objects]]\nbuiltin = "ball"\ndiameter = 0.065\nmass = 0.1\n[[objects]]\nbuiltin = "glass"\n'
        "[wrist]\nelevation = [-10, 60]\ntilt = [0, 25]\n[measuring]\nedges = 8\nsqueeze = 1.0\n"
    )


def _fem(path: Path) -> None:
    path.write_text(
        'title = "Box"\ninitial_stress = [0, 0, 0, 0, 0, 0]\n'
        '[mesh]\nkind = "box"\nsize = [1, 1, 2]\ncounts = [2, 2, 3]\n'
        '[material.body]\nlaw = "neo-hooke"\nyoung = 1.2e6\npoisson = 0.4\ndensity = 1100.0\n'
        '[sets.top]\nof = "z+"\nabove = {x = 0.2}\n[[step]]\nname = "press"\ngravity = [0, 0, -9.81]\ninstants = 2\n'
        'pressure = {"z+" = 10.0}\n[[step.prescribed]]\nwhere = "z-"\nx = 0.0\ny = 0.0\nz = 0.0\n'
    )


def _study_folder(path: Path) -> None:
    path.write_text(json.dumps(_Nothing().identity()))


def _opened(path: Path) -> object:
    folder = path.with_name("study")
    folder.mkdir(exist_ok=True)
    (folder / "study.json").write_bytes(path.read_bytes())
    opened(_Nothing(), folder)
    return None


def _shard(path: Path) -> None:
    folder = path.with_name("kept")
    Shards(folder).write(Shard(0, {"trial": 0, "status": "closed"}, {"angles": np.arange(6.0).reshape(2, 3)}, 1.5))
    path.write_bytes(Shards(folder).path(0).read_bytes())


def _kept_shard(path: Path) -> object:
    shards = Shards(path.with_name("kept"))
    shards.path(0).write_bytes(path.read_bytes())
    return shards.read(0)


@dataclass(frozen=True)
class _Nothing:
    """An experiment as far as folders of studies know it."""

    trials: int = 3
    columns: tuple[Column, ...] = ()

    def identity(self) -> dict[str, object]:
        return {"kind": "nothing", "seed": 4, "trials": self.trials, "hands": [{"name": "a", "length": 0.19}]}


def _deformed(path: Path) -> object:
    """Positions that the surface takes, shape (2, V, 3)."""
    rig = load_rig(path)
    angles = np.zeros((2, len(rig.skeleton), 4))
    angles[1, :, 0] = 0.3
    return bind_rig(rig).deform(poses_from_angles(rig.skeleton, angles), threads=1)


def _script(path: Path) -> None:
    _glb(path.with_name("rig.glb"))
    _csv(path.with_name("curl.csv"))
    path.write_text(
        'BODY "rig.glb" UNIT M NAME finger  # comment\nMACRO CURL to\n  TURN finger 0 $to 0 0\nEND\n'
        "SIZE 64 48\nRATE 24\n"
        "FRAMES 0 4\nMOVE finger 0 0 0 0\nMOVE finger 4 0.01 0 (2 * 0.01)\nCURL 20\nOBJECT ball BALL 0.03 AT 0 0.05 0\n"
        "PARAMETER ALL INFLATION 0.2\nMETHOD SMOOTH\nCAMERA FRONT ZOOM 1.2 FOLLOW\nPICTURE 1 'p.png' WIREFRAME\n"
        'EXPORT "e.npz" finger\nPRINT "done $to" 3\n'
    )


def _checked_script(path: Path) -> object:
    scene = Scene(folder=path.with_name("out"), say=lambda text: None, warn=lambda text: None)
    Interpreter(scene).run_file(path)
    run_scene(scene, path.with_name("out"), script=path, dry=True)
    for actor in scene.actors.values():
        return stage(actor, frame_numbers(scene)[:100], scene.rate)
    return None


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
    "webxr.json": (_recording("webxr"), _held_hand),
    "leap.json": (_recording("leap"), _held_hand),
    "mediapipe.json": (_recording("mediapipe"), _held_hand),
    "mano.json": (_recording("mano"), _held_hand),
    "mano.npz": (_mano, _held_hand),
    "landmarks.npy": (_landmarks, _held_hand),
    "deformed.glb": (_glb, _deformed),
    "object.obj": (_shape("obj"), _object),
    "object.ply": (_shape("ply"), _object),
    "object.off": (_shape("off"), _object),
    "object.stl": (_shape("stl"), _object),
    "object.glb": (_shape("glb"), _object),
    "bag.npz": (_bag, lambda path: load_keyframes(path)),
    "parameters.json": (_parameters, lambda path: load_parameters(path, RIG.skeleton)),
    "targets.npz": (_targets, lambda path: read_targets(path, RIG)),
    "plan.toml": (_plan, load_plan),
    "fem.toml": (_fem, load_study),
    "study.json": (_study_folder, _opened),
    "trial.json": (_shard, _kept_shard),
    "state.npz": (write_state, read_state),
    "a.jld": (_script, _checked_script),
    **MORE,
    **PACKED,
}
"""How a sound file of each kind is written, and what reads it."""


def sound(name: str, folder: Path) -> Path:
    """A sound file."""
    path = folder / name
    if name == "a.obj":
        _joints(folder / "joints.json")
    KINDS[name][0](path)
    return path
