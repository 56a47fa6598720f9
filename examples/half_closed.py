"""A hand that was digitised half closed is opened flat: the angles of its rest pose are given (A §3, R25).

python examples/half_closed.py out
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import trimesh

from warpjld.covering import bind_rig
from warpjld.geometry.rotations import rotate
from warpjld.hand import build_hand
from warpjld.script import Interpreter, Scene
from warpjld.script.runner import run_scene
from warpjld.skeleton import CHANNELS, poses_from_angles

HALF_CLOSED = {"base": 40.0, "knuckle2": 55.0, "knuckle3": 35.0}
SCRIPT = """
MODEL "digitised.obj" SKELETON "joints.json" UNIT M NAME hand
CAMERA RADIAL
PICTURE 0 "digitised.png"
{flat}
PICTURE 10 "flat.png"
EXPORT "hand.npz"
"""


def digitise(folder: Path) -> np.ndarray:
    """Files of a half closed hand and of its joints, as a digitiser would have them; the flat one's vertices."""
    hand = build_hand("left", resolution=1500)
    angles = np.zeros((1, len(hand.skeleton), len(CHANNELS)))
    for digit in ("index", "middle", "ring", "pinky"):
        for joint, degrees in HALF_CLOSED.items():
            angles[0, hand.skeleton.index(f"{digit}.{joint}"), 0] = np.radians(degrees)
    pose = poses_from_angles(hand.skeleton, angles)
    skin = bind_rig(hand).deform(pose)[0]
    trimesh.Trimesh(skin, hand.surface.faces, process=False).export(folder / "digitised.obj")
    axes = rotate(pose.rotations[0], hand.skeleton.axes)
    joints = [
        {
            "name": name,
            "parent": None if parent < 0 else hand.skeleton.names[parent],
            "position": place.tolist(),
            "axis": axis.tolist(),
            "initial": {"flexion": float(np.degrees(angles[0, j, 0]))},
        }
        for j, (name, parent, place, axis) in enumerate(
            zip(hand.skeleton.names, hand.skeleton.parents, pose.positions[0], axes, strict=True)
        )
    ]
    (folder / "joints.json").write_text(json.dumps({"joints": joints}), encoding="utf-8")
    return hand.surface.vertices


def main(folder: Path, size: tuple[int, int] = (960, 720)) -> float:
    """Root of the mean square distance of the opened skin from the flat hand [mm]."""
    folder.mkdir(parents=True, exist_ok=True)
    flat = digitise(folder)
    keys = [
        f"JOINT left.{digit}.{joint} FLEXION {when} {angle:g}"
        for digit in ("index", "middle", "ring", "pinky")
        for joint, degrees in HALF_CLOSED.items()
        for when, angle in (("AT 0", degrees), ("AT 10", 0.0))
    ]
    script = folder / "half_closed.jld"
    script.write_text(SCRIPT.format(flat="\n".join(keys)), encoding="utf-8")
    scene = Scene(folder=folder, say=lambda text: None, size=size)
    Interpreter(scene).run_file(script)
    run_scene(scene, folder)
    with np.load(folder / "hand.npz") as file:
        opened = file["vertices"][-1]
    return 1e3 * float(np.sqrt(((opened - flat) ** 2).sum(axis=1).mean()))


if __name__ == "__main__":
    print(f"{main(Path(sys.argv[1] if len(sys.argv) > 1 else 'out')):.2f} mm from the flat hand")
