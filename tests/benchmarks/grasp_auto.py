"""GRASP … AUTO over hands × objects: which pairs end in a grasp, how good it is, and what it takes.

    PYTHONPATH=.:kernels python tests/benchmarks/grasp_auto.py [--hands left webxr] [--objects mug bowl] [--count 192]
        [--save table.csv]

Hands and objects of others are looked for in ``shared/data`` beside the repository; without it only built-in ones run.
What no hand can span (``crate``) counts as taken where it is refused with its width.

Columns: how it ended, the digits that touch, epsilon [N], depth [mm], the posture, placements tried, processor time of
``find_grasp`` [s], structures of hand and object included, reading and binding not.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np

from warpjld.covering import Covering, bind
from warpjld.errors import InputError
from warpjld.grasp import GraspObject, load_object, make_object
from warpjld.grasp.find_grasp import find_grasp
from warpjld.grasp.shapes import SHAPES, box
from warpjld.hand import build_hand
from warpjld.io import load_rig
from warpjld.runtime.quiet import silence_warp

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"

HANDS = {
    "left": None,
    "webxr": "hand_webxr_generic/right.glb",
    "anny": "hand_anny/right.glb",
    "godot": "hand_godot_low/Hand_low_R.gltf",
}
FILES = {
    "pepper": ("bell_pepper/bell_pepper.glb", "m"),
    "teacup": ("godot_teacup/teacup.glb", "m"),
    "mug": ("mujoco_mug/mug.obj", "cm"),
    "pingpong": ("pingpong_ball/ping_pong_ball.glb", "m"),
    "bread": ("robosuite_can_lemon_bread/bread.obj", "m"),
    "can": ("robosuite_can_lemon_bread/can.obj", "m"),
    "lemon": ("robosuite_can_lemon_bread/lemon.obj", "m"),
    "mustard": ("ycb_mustard_bottle/ycb_mustard_bottle.glb", "m"),
    "meat": ("ycb_potted_meat_can/ycb_potted_meat_can.glb", "m"),
    "sugar": ("ycb_sugar_box/ycb_sugar_box.glb", "m"),
    "bowl": ("evo_bowl/evo_bowl.glb", "m"),
}
MADE = ("plate", "dish", "ring", "stack", "flat box", "crate")
REFUSED = {"crate"}
COLUMNS = ("hand", "object", "end", "touching", "epsilon", "depth_mm", "posture", "tried", "seconds")


def main() -> None:
    """Run what is asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hands", nargs="+", choices=HANDS, default=list(HANDS))
    parser.add_argument("--objects", nargs="+", choices=[*FILES, *MADE], default=[*FILES, *MADE])
    parser.add_argument("--count", type=int, default=192, help="placements at most")
    parser.add_argument("--save", type=Path, help="CSV")
    arguments = parser.parse_args()
    silence_warp()
    rows: list[dict[str, object]] = []
    for hand in arguments.hands:
        if HANDS[hand] and not DATA.is_dir():
            continue
        covering = bound(hand)
        for thing in arguments.objects:
            if thing in MADE or DATA.is_dir():
                rows.append(case(hand, covering, thing, arguments.count))
                print(*(str(rows[-1][column])[:100] for column in COLUMNS), sep=" | ", flush=True)
    good = sum((row["end"] == "found") != (row["object"] in REFUSED) for row in rows)
    took = [row["seconds"] for row in rows]
    print(f"{good} of {len(rows)} as they should be; median {np.median(took):.2f} s, most {max(took):.2f} s")
    if arguments.save:
        with arguments.save.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)


def case(hand: str, covering: Covering, name: str, count: int) -> dict[str, object]:
    """One pair."""
    row: dict[str, object] = dict.fromkeys(COLUMNS, "") | {"hand": hand, "object": name}
    begun = time.process_time()
    try:
        thing = made(name) if name in MADE else load_object(DATA / FILES[name][0], unit=FILES[name][1], centre=True)
        begun = time.process_time()
        found = find_grasp(covering, thing, count=count)
    except InputError as error:
        row |= {"end": error.message, "seconds": round(time.process_time() - begun, 2)}
        return row
    return row | {
        "end": "found",
        "touching": " ".join(name.partition(".")[2] for name in found.touching),
        "epsilon": round(found.verdict.epsilon, 3),
        "depth_mm": round(1e3 * found.penetration, 2),
        "posture": found.posture,
        "tried": found.tried,
        "seconds": round(time.process_time() - begun, 2),
    }


def bound(name: str) -> Covering:
    """A hand that is ready."""
    path = HANDS[name]
    rig = build_hand("left", resolution=4000) if path is None else load_rig(DATA / path)
    return bind(rig.skeleton, rig.surface)


def made(name: str) -> GraspObject:
    """Objects that hands have had trouble with."""
    if name == "plate":
        return SHAPES["plate"](0.2, 0.02)
    if name == "dish":  # a bowl of 16 cm with a wall of 3 mm
        return SHAPES["glass"](0.16, 0.06, thickness=0.003)
    if name == "ring":  # a handle: a torus, 9 cm across, 12 mm thick
        return torus(0.039, 0.006)
    if name == "stack":  # two boxes of one mesh that share the ring where they meet
        return stacked(0.05, 0.05, 0.06)
    if name == "flat box":
        return box(0.2, 0.05, 0.28)
    return box(0.4, 0.3, 0.35)


def torus(large: float, small: float, around: int = 72, across: int = 20) -> GraspObject:
    """A ring about z, radii of its middle and of its section [m]."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2.0 * np.pi * u / around, 2.0 * np.pi * v / across
    out = large + small * np.cos(b)
    points = np.stack([out * np.cos(a), out * np.sin(a), small * np.sin(b)], axis=-1).reshape(-1, 3)
    one, right = u * across + v, (u + 1) % around * across + v
    up, both = u * across + (v + 1) % across, (u + 1) % around * across + (v + 1) % across
    faces = np.concatenate([np.stack([one, right, both], axis=-1), np.stack([one, both, up], axis=-1)]).reshape(-1, 3)
    return make_object("ring", points, faces)


def stacked(width: float, depth: float, height: float) -> GraspObject:
    """Two boxes one on the other, closed each, four corners and the edges between them in common."""
    x, z = 0.5 * width, 0.5 * depth
    ring = np.array([(-x, -z), (x, -z), (x, z), (-x, z)])
    levels = [np.insert(ring, 1, y, axis=1) for y in (-0.5 * height, 0.0, 0.5 * height)]
    faces = []
    for low in (0, 4):
        high = low + 4
        faces += [(low, low + 1, low + 2), (low, low + 2, low + 3)]
        faces += [(high, high + 2, high + 1), (high, high + 3, high + 2)]
        for k in range(4):
            m = (k + 1) % 4
            faces += [(low + k, high + k, high + m), (low + k, high + m, low + m)]
    return make_object("stack", np.concatenate(levels), np.array(faces))


if __name__ == "__main__":
    main()
