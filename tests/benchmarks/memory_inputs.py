"""Long motions of the built-in left hand in every format that is read, for the benchmark of memory.

    python -m tests.benchmarks.memory_inputs FOLDER FRAMES NAME

Fingers bend back and forth; every frame differs from the next. A short motion is repeated in the recordings.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pygltflib as gl
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import warpjld as wj
from tests.fuzz.sound import _skinned
from tests.io import fbx_text
from tests.io.vrm_files import with_humanoid
from tests.motion import skinned_files
from tests.motion.hand_files import camera_landmarks, webxr_poses
from tests.motion.test_hand_sides import leap_frames
from warpjld.motion.out import write_motion
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.streamed_poses import streamed_rows

__all__ = ["make"]

_LEFT = '{"handedness": "Left", "frames": ['
_PERIOD = 50  # frames after which a recording repeats
_FINGERS = ("index", "middle", "ring", "pinky")
_BENDS = {"base": 60.0, "knuckle2": 80.0, "knuckle3": 40.0}  # degrees


def make(folder: Path, frames: int, name: str) -> None:
    """Write a file to a folder: ``hand.glb``, the rig; ``finger.glb``, another one with its motion; or a motion."""
    hand = wj.build_hand("left", resolution=1500)
    poses = _poses(hand, 1 if name == "hand.glb" else frames)
    period = _poses(hand, _PERIOD)[:_PERIOD]
    makers: dict[str, Callable[[Path], object]] = {
        "finger.glb": lambda path: _finger(path, frames),
        "m.csv": lambda path: _table(path, frames),
        "m.vrma": lambda path: _vrma(path, hand, poses),
        "m.fbx": lambda path: _fbx(path, hand, poses),
        "mano.json": lambda path: _mano(path, hand, period, frames),
        "points.npy": lambda path: _points_array(path, hand, period, frames),
        "points.json": lambda path: _listed(
            path, _landmarks(hand, period), frames, '{"handedness": "Left", "frames": ['
        ),
        "points.jsonl": lambda path: _lines(path, _landmarks(hand, period), frames),
        "leap.json": lambda path: _leap(path, hand, period, frames),
        "webxr.json": lambda path: _webxr(path, hand, period, frames),
    }
    other = makers.get(name)
    if other is None:
        write_motion(folder / name, hand, poses, rate=30.0)
    else:
        other(folder / name)


def _angles(frames: NDArray[np.float64], finger: int) -> NDArray[np.float64]:
    """Share of the largest bend, between 0 and 1."""
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * (frames / _PERIOD + 0.1 * finger))


def _poses(hand: wj.Rig, count: int) -> Poses:
    skeleton = hand.skeleton

    def some(frames: slice) -> Poses:
        numbers = np.arange(frames.start, frames.stop, dtype=np.float64)
        angles = np.zeros((len(numbers), len(skeleton), 4))
        for f, finger in enumerate(_FINGERS):
            for joint, most in _BENDS.items():
                angles[:, skeleton.index(f"left.{finger}.{joint}"), 0] = np.radians(most) * _angles(numbers, f)
        return poses_from_angles(skeleton, angles)

    return streamed_rows(count, some)


def _finger(path: Path, frames: int) -> None:
    numbers = np.arange(frames, dtype=np.float64)
    bends = Rotation.from_euler("x", -_angles(numbers, 0)[:, None]).as_quat().astype(np.float32)
    skinned_files.write(
        path, _skinned(), {"bend": {(1, "rotation"): ((numbers / 30).astype(np.float32), bends, "LINEAR")}}
    )


def _table(path: Path, frames: int) -> None:
    numbers = np.arange(frames, dtype=np.float64)
    columns = {f"{finger}.{joint}.flexion": most * _angles(numbers, f)
               for f, finger in enumerate(_FINGERS) for joint, most in _BENDS.items()}  # fmt: skip
    with path.open("w") as file:
        file.write(",".join(["frame", *columns]) + "\n")
        for frame, row in enumerate(zip(*columns.values(), strict=True)):
            file.write(f"{frame}," + ",".join(f"{value:.3f}" for value in row) + "\n")


def _vrma(path: Path, hand: wj.Rig, poses: Poses) -> None:
    write_motion(path.with_suffix(".vrma.glb"), hand, poses, rate=30.0)
    parts = {"base": "Proximal", "knuckle2": "Intermediate", "knuckle3": "Distal"}
    names = [node.name for node in gl.GLTF2().load_binary(str(path.with_suffix(".vrma.glb"))).nodes]
    bones = {"leftHand": names.index("left.wrist")}
    for finger in _FINGERS:
        for joint, part in parts.items():
            title = "Little" if finger == "pinky" else finger.capitalize()
            bones[f"left{title}{part}"] = names.index(f"left.{finger}.{joint}")
    with_humanoid(path.with_suffix(".vrma.glb"), "animation", bones).rename(path)


def _fbx(path: Path, hand: wj.Rig, poses: Poses) -> None:
    from warpjld.motion.out.source_motion import source_motion

    motion = source_motion(hand, poses)
    worlds = np.concatenate([motion.worlds(block) for block in motion.blocks()])
    fbx_text.Fbx(motion.tree.names, motion.tree.parents.tolist(), motion.tree.frames, stacks={"m": worlds}).write(path)


def _mano(path: Path, hand: wj.Rig, period: Poses, frames: int) -> None:
    from warpjld.motion.out.mano import hand_parameters

    found = hand_parameters(hand.skeleton, period, "left")
    rows = [{name: array[k].round(6).tolist() for name, array in found.items()} for k in range(_PERIOD)]
    head = '{"flat_hand_mean": true, "side": "left", "fps": 30, "frame": "rig", "frames": ['
    _listed(path, [json.dumps(row) for row in rows], frames, head)


def _landmarks(hand: wj.Rig, period: Poses) -> list[str]:
    points = camera_landmarks(hand.skeleton, "left", period).round(5)
    return [json.dumps({"world_landmarks": [dict(zip("xyz", p, strict=True)) for p in one]}) for one in points.tolist()]


def _points_array(path: Path, hand: wj.Rig, period: Poses, frames: int) -> None:
    points = camera_landmarks(hand.skeleton, "left", period)
    np.save(path, points[np.arange(frames) % _PERIOD])


def _leap(path: Path, hand: wj.Rig, period: Poses, frames: int) -> None:
    found = leap_frames(hand.skeleton, {"left": list(period.positions.round(6))})["frames"]
    stamp = '"timestamp": '
    rests = [json.dumps(frame).partition(stamp)[2].partition(",")[2] for frame in found]
    texts = (f"{{{stamp}{1_000_000 + 10_000 * k},{rests[k % _PERIOD]}" for k in range(frames))
    _write(path, '{"frames": [', texts, "]}")


def _webxr(path: Path, hand: wj.Rig, period: Poses, frames: int) -> None:
    names = tuple(str(k) for k in range(_PERIOD))
    texts = [json.dumps(one) for one in webxr_poses(hand.skeleton, "left", period, names).values()]
    _write(path, '{"handedness": "left", ', (f'"pose {k}": {texts[k % _PERIOD]}' for k in range(frames)), "}")


def _listed(path: Path, texts: list[str], frames: int, head: str) -> None:
    _write(path, head, (texts[k % len(texts)] for k in range(frames)), "]}")


def _lines(path: Path, texts: list[str], frames: int) -> None:
    with path.open("w") as file:
        file.writelines(f"{texts[k % len(texts)]}\n" for k in range(frames))


def _write(path: Path, head: str, items: Iterator[str], tail: str) -> None:
    with path.open("w") as file:
        file.write(head)
        for k, item in enumerate(items):
            file.write((",\n" if k else "") + item)
        file.write(tail)


if __name__ == "__main__":
    make(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
