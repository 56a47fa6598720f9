"""A hand of three meshes (fingers, palm, a cuff joined to the wrist) stays in one piece with both methods (A §3, R18).

python examples/pieces.py out
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.normals import vertex_normals
from warpjld.hand import build_hand
from warpjld.io.skeleton_file import write_skeleton_file
from warpjld.script import Interpreter, Scene
from warpjld.script.runner import run_scene

KNUCKLES, CUFF = -0.10, (-0.005, -0.035)  # where fingers begin, and the cuff ends, along the hand [m]
SCRIPT = """
MODEL "pieces.obj" SKELETON "joints.json" UNIT M NAME hand
METHOD {method}
WRIST LEFT FLEXION AT 0 0
WRIST LEFT FLEXION AT 10 50
{fist}
CAMERA THREE-QUARTER-BACK
PICTURE 10 "{method}.png"
EXPORT "{method}.npz"
"""


def write_pieces(folder: Path) -> NDArray[np.float64]:
    """The hand's files; its vertices in the file's order."""
    hand = build_hand("left", resolution=1500)
    points, faces = hand.surface.vertices, hand.surface.faces
    along = points[:, 2]
    fingers = (along[faces] < KNUCKLES).all(axis=1)
    around = ((along < CUFF[0]) & (along > CUFF[1]))[faces].all(axis=1)
    cloth = points + 0.002 * vertex_normals(points, faces)
    edges = np.sort(faces[around][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, times = np.unique(edges, axis=0, return_counts=True)
    sewn = np.unique(once[times == 1])  # the cuff's border, which lies on skin
    cloth[sewn] = points[sewn]
    lines, written, count = [], [], 0
    for name, places, some in (("palm", points, ~fingers), ("fingers", points, fingers), ("cuff", cloth, around)):
        used, corners = np.unique(faces[some], return_inverse=True)
        lines.append(f"o {name}")
        lines += [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in places[used]]
        lines += [f"f {a} {b} {c}" for a, b, c in corners.reshape(-1, 3) + count + 1]
        written.append(places[used])
        count += len(used)
    (folder / "pieces.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")
    write_skeleton_file(folder / "joints.json", hand.skeleton)
    return np.concatenate(written)


def main(folder: Path, size: tuple[int, int] = (960, 720)) -> dict[str, float]:
    """How far vertices that are one place at rest part [mm], by method."""
    folder.mkdir(parents=True, exist_ok=True)
    rest = write_pieces(folder)
    _, place = np.unique(rest.round(8), axis=0, return_inverse=True)
    fist = [
        f"JOINT left.{digit}.{joint} FLEXION {when} {angle}"
        for digit in ("index", "middle", "ring", "pinky")
        for joint, full in (("base", 60), ("knuckle2", 70), ("knuckle3", 40))
        for when, angle in (("AT 0", 0), ("AT 10", full))
    ]
    parted = {}
    for method in ("SMOOTH", "PAPER"):
        script = folder / f"{method.lower()}.jld"
        script.write_text(SCRIPT.format(method=method.lower(), fist="\n".join(fist)), encoding="utf-8")
        scene = Scene(folder=folder, say=lambda text: None, size=size)
        Interpreter(scene).run_file(script)
        run_scene(scene, folder)
        with np.load(folder / f"{method.lower()}.npz") as file:
            skin = file["vertices"][-1]
        order = np.argsort(place.ravel(), kind="stable")
        same = np.diff(place.ravel()[order]) == 0
        parted[method] = 1e3 * float(np.linalg.norm(np.diff(skin[order], axis=0)[same], axis=1).max())
    return parted


if __name__ == "__main__":
    for method, gap in main(Path(sys.argv[1] if len(sys.argv) > 1 else "out")).items():
        print(f"{method}: borders part by {gap:.4f} mm")
