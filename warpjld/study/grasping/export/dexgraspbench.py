"""Export in the format of DexGraspBench: one dictionary per ``.npy`` file, and ``header.json`` that explains them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.files.manifest import write_json
from warpjld.files.whole_file import whole_file
from warpjld.study.grasping.export.grasps import ClosedTrial, exported_posture
from warpjld.study.grasping.load import hand_of

__all__ = ["write_dexgraspbench"]


def write_dexgraspbench(trials: Sequence[ClosedTrial], folder: Path) -> list[Path]:
    """Write one file per grasp, in folders by hand and object; dictionaries are pickles, which readers must allow."""
    folder.mkdir(parents=True, exist_ok=True)
    header = folder / "header.json"
    write_json(header, _header(trials))
    files = [header]
    for trial in trials:
        path = folder / trial.hand.name / trial.thing.name / f"{trial.name}.npy"
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part, part.open("wb") as file:
            np.save(file, np.array(_content(trial, trials), dtype=object), allow_pickle=True)
        files.append(path)
    return files


def _content(trial: ClosedTrial, trials: Sequence[ClosedTrial]) -> dict[str, Any]:
    joints = exported_posture(trial, trials)
    qpos = np.array([*trial.position.tolist(), *trial.quaternion, *joints.values()])
    return {
        "grasp_qpos": qpos,
        "obj_pose": np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        "obj_scale": trial.scale,
        "obj_path": f"objects/{trial.thing.name}.obj",
        "joint_names": list(joints),
        "hand": trial.hand.name,
        "friction": trial.row["friction"],
        "mass": trial.row["mass"],
    }


def _header(trials: Sequence[ClosedTrial]) -> dict[str, Any]:
    hands = {trial.hand.name: trial for trial in trials}
    return {
        "units": {"length": "m", "angle": "rad", "mass": "kg"},
        "grasp_qpos": "x, y, z, qw, qx, qy, qz of the hand's frame in the world, then the joints in their order",
        "hand_frame": "origin in the root joint, axes of the hand's rig at rest",
        "world": "the object's frame: Y up, the middle of its bounding box at 0",
        "joints": "JOINT.CHANNEL, channels flexion, pivot, twisting, abduction; what is not named is as at rest",
        "hands": {
            name: {
                "root": hand_of(trial.hand).rig.skeleton.names[0],
                "joint_names": list(exported_posture(trial, trials)),
            }
            for name, trial in hands.items()
        },
    }
