"""Files that show contact: whether they can be made, and their making (R95)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.simulation.specification import placed
from warpjld.script.folder import OutputFolder
from warpjld.script.outputs import Film, Grips, Output, Picture, Table, Touch, Volume

if TYPE_CHECKING:
    from warpjld.script.pressing import PressReport
    from warpjld.script.scene import Scene

__all__ = ["check_press", "write_press"]


def check_press(scene: Scene, outputs: Sequence[Output], frames: NDArray[np.float64]) -> list[str]:
    """Raise where something is asked for that only PRESS gives, at frames it does not solve; notes on the others.

    Args:
        scene: What the script described.
        outputs: Files to make.
        frames: Frames to make, shape (F,).
    """
    pressing = scene.contact.pressing
    span = "" if pressing is None else f"PRESS solves frames {pressing.first} to {pressing.last}"
    for output in outputs:
        problem = ""
        colored = isinstance(output, Film | Picture) and output.style == "pressure"
        if pressing is None:
            if colored or isinstance(output, Table | Touch | Volume):
                problem = "shows contact, but none is solved: PRESS <first> <last> asks for it"
        elif isinstance(output, Picture) and colored and not pressing.first <= output.frame <= pressing.last:
            problem = f"shows pressure at frame {output.frame:g}, but {span}"
        elif isinstance(output, Touch) and (output.actor or "") not in ("", *scene.contact.flesh):
            problem = f"shows what {output.actor} feels, but it has no flesh: FLESH {output.actor} makes it so"
        elif isinstance(output, Touch) and not scene.contact.flesh:
            problem = "shows what skin feels, but no actor has flesh: FLESH <actor> makes it so"
        if problem:
            raise placed(InputError(f"'{output.name}' {problem}"), scene.asked.get(output.name))
    if pressing is None:
        return []
    first, last = float(frames[0]), float(frames[-1])
    if pressing.last < first or pressing.first > last:
        raise placed(InputError(f"{span}, but {first:g} to {last:g} are made: see FRAMES"), pressing.where)
    return [f"{span}, of which those after {last:g} are not made: see FRAMES"] if pressing.last > last else []


def write_press(report: PressReport, outputs: Sequence[Output], out: OutputFolder) -> None:
    """Tables and volumes."""
    from warpjld.simulation.grip.find import write_grips
    from warpjld.simulation.report.table import write_table
    from warpjld.simulation.report.volume_series import write_volumes

    for output in outputs:
        if isinstance(output, Table):
            write_table(out.place(output.name), report.rows)
        elif isinstance(output, Grips):
            write_grips(out.place(output.name), report.grips)
        elif isinstance(output, Touch):
            _write_touch(report, output, out.place(output.name))
        elif isinstance(output, Volume):
            write_volumes(out.place(output.name), report.pressed)


def _write_touch(report: PressReport, output: Touch, path: Path) -> None:
    from warpjld.simulation.report.tactile_files import draw_tactile, write_tactile

    actor = output.actor or next((hand.name for hand in report.pressed.bodies.hands), "nobody")
    felt = report.tactile(actor)
    if path.suffix == ".png":
        draw_tactile(path, felt, f"What the skin of {actor} feels", "frame")
    else:
        write_tactile(path, felt)
