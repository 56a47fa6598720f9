"""A joint that was placed 10 mm too far along its finger is found, and moved back by what is proposed (B §2.1, R14).

python examples/misplaced.py out
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh

import warpjld as wj
from warpjld.io.points_file import write_points_file
from warpjld.script import Interpreter, Scene
from warpjld.script.runner import run_scene
from warpjld.skeleton.recognise.placing.check import check_placing

JOINT = "left.index.knuckle2"
SCRIPT = """
MODEL "hand.obj" POINTS "{name}.json" UNIT M NAME hand
FRAMES 0 0
FINGER1 LEFT INDEX FLEXION AT 0 60
FINGER23 LEFT INDEX KNUCKLES2 AT 0 90
CAMERA RADIAL
PICTURE 0 "{name}.png"
"""


def draw(folder: Path, name: str, size: tuple[int, int]) -> None:
    """The index finger, bent about the points of ``name``.json."""
    scene = Scene(folder=folder, say=lambda text: None, size=size)
    script = folder / f"{name}.jld"
    script.write_text(SCRIPT.format(name=name), encoding="utf-8")
    Interpreter(scene).run_file(script)
    run_scene(scene, folder)


def main(folder: Path, size: tuple[int, int] = (960, 720)) -> tuple[list[str], float]:
    """What is said of the joints, and how far from its place the joint is once it was moved [mm]."""
    folder.mkdir(parents=True, exist_ok=True)
    hand = wj.build_hand("left", resolution=1500)
    surface = folder / "hand.obj"
    trimesh.Trimesh(hand.surface.vertices, hand.surface.faces, process=False).export(surface)
    points = dict(zip(hand.skeleton.names, hand.skeleton.rest, strict=True))
    del points["left.forearm"]  # none of a hand's 25 points
    right = points[JOINT]
    along = points["left.index.knuckle3"] - right
    points[JOINT] = right + 0.010 * along / np.linalg.norm(along)
    write_points_file(folder / "misplaced.json", points)
    rig = wj.load_rig(surface, points=folder / "misplaced.json", unit="m")
    found = check_placing(rig.skeleton, rig.surface.vertices, rig.surface.faces)
    for one in found:
        if one.proposal is not None:
            points[one.joint] = points[one.joint] + 1e-3 * np.array(one.proposal)
    write_points_file(folder / "moved.json", points)
    for name in ("misplaced", "moved"):
        draw(folder, name, size)
    return [one.message for one in found], 1e3 * float(np.linalg.norm(points[JOINT] - right))


if __name__ == "__main__":
    messages, left = main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
    print(*messages, f"after moving it, {left:.1f} mm from its place", sep="\n")
