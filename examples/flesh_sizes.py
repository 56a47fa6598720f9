"""How forces depend on the size of the flesh's elements: a fingertip on a plate, meshed several times.

python examples/flesh_sizes.py [sizes in mm …]

Prints a table of the size and number of elements, and force, area and peak pressure half-way and at the end of
``press_plate.jld``, with the message about elements that are too large.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from warpjld.script.contact import run_contact
from warpjld.script.interpreter import Interpreter
from warpjld.script.scene import Scene

SCRIPT = Path(__file__).with_name("press_plate.jld")
FRAMES = (18.0, 20.0)


def main(sizes: list[float]) -> list[list[float]]:
    """Rows of the table: size [mm], elements, then force [N], area [mm²] and peak pressure [kPa] at each frame."""
    rows = []
    print("| size, mm | elements | " + " | ".join(f"frame {f:g}: N | mm² | kPa" for f in FRAMES) + " |")
    print("|" + "---|" * (2 + 3 * len(FRAMES)))
    for size in sizes:
        with tempfile.TemporaryDirectory() as folder:
            scene = Scene(folder=Path(folder), say=lambda text: None)
            Interpreter(scene).run_file(SCRIPT)
            scene.contact.flesh["LEFT"] = replace(scene.contact.flesh["LEFT"], element=1e-3 * size)
            report = run_contact(scene, Path(folder))
        row = [size, float(len(report.model.body.mesh.elements))]
        for frame in FRAMES:
            pads = [pad for pad in report.rows if pad.frame == frame and pad.force_n > 0.0]
            row += [sum(pad.force_n for pad in pads), sum(pad.area_mm2 for pad in pads)]
            row.append(max((pad.peak_kpa for pad in pads), default=0.0))
        rows.append(row)
        print("| " + " | ".join(f"{value:.3g}" if value < 1e3 else f"{value:.0f}" for value in row) + " |", flush=True)
        for note in report.notes:
            print(f"  {note}", flush=True)
    return rows


if __name__ == "__main__":
    main([float(size) for size in sys.argv[1:]] or [2.2, 3.0, 4.0])
