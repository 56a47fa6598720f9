"""Find grasps of several hands on several objects automatically: a table of all grasps, and pictures.

python examples/grasp_objects.py FOLDER [STUDY.toml]

The study names hands, objects, friction, seed and the number of placements of which each grasp is the best
(wrist.best_of); by default a built-in hand grasps a ball, a box, a glass and a plate. Writes grasps.md into FOLDER, and
a picture per hand, with a row per object. A grasp holds if it is force closed and the penetration is at most 1 mm: of
the skin into the object, and of the object into the skin.
"""

import sys
import time
from pathlib import Path

from warpjld.study.experiment import generator
from warpjld.study.grasping import GraspExperiment, load_plan
from warpjld.study.grasping.load import hand_of, thing_of
from warpjld.study.grasping.pictures import grasp_views

DEFAULT = Path(__file__).with_name("grasp_objects.toml")
VIEWS = ("palmar", "three-quarter", "radial", "tips")


def main(folder: Path, study: Path = DEFAULT) -> list[dict]:
    """Write table and pictures into a folder; return the table's rows."""
    from warpjld.render import grid, save_picture

    folder.mkdir(parents=True, exist_ok=True)
    experiment = GraspExperiment(load_plan(study))
    rows, sheets = [], {}
    for trial in range(experiment.trials):
        hand, thing, scale, _ = experiment.settings.combination(trial)
        body = thing_of(thing, scale, experiment.settings.measuring.density).body
        begun = time.process_time()
        outcome = experiment.run(trial, generator(experiment.seed, trial))
        row = {"hand": hand.name, "object": thing.name, "seconds": time.process_time() - begun, **outcome.values}
        rows.append(row)
        print(line(row), flush=True)
        if pictures := grasp_views(hand_of(hand), body, outcome, VIEWS, size=(400, 380)):
            sheets.setdefault(hand.name, []).append(pictures)
    held = sum(bool(row.get("success")) for row in rows)
    seconds = sorted(row["seconds"] for row in rows)
    told = (
        f"{held} of {len(rows)} grasps hold; median {seconds[len(seconds) // 2]:.1f} s a grasp, seed {experiment.seed}"
    )
    (folder / "grasps.md").write_text("\n".join([HEAD, *map(line, rows), "", told, ""]), encoding="utf-8")
    for name, pictures in sheets.items():
        save_picture(folder / f"{name}.png", grid(pictures, captions=VIEWS, title=name))
    print(told)
    return rows


HEAD = """| hand | object | holds | epsilon [N] | digits | palm | penetration [mm] | sag [mm] | CPU time [s] |
|---|---|---|---|---|---|---|---|---|"""


def line(row: dict) -> str:
    """A row of the table."""
    start = f"| {row['hand']} | {row['object']} |"
    if "success" not in row:
        return f"{start} no grasp found | | | | | | {row['seconds']:.1f} |"
    holds = "yes" if row["success"] else "no"
    palm = "yes" if row["area_palm"] > 0.0 else "no"
    sag = "not held" if row["displacement"] is None else f"{1e3 * row['displacement']:.2f}"
    return (
        f"{start} {holds} | {row['epsilon']:.3f} | {row['digits']} | {palm} | {1e3 * row['penetration']:.2f} | {sag} | "
        f"{row['seconds']:.1f} |"
    )


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
