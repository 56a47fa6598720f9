"""The deformed volumes as a VTK series: displacement, reaction and stress (R95)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from warpjld.fem import Instant
from warpjld.fem.output.vtk import Series
from warpjld.simulation.display.surfaces import Pressed

__all__ = ["write_volumes"]


def write_volumes(path: Path, pressed: Pressed) -> None:
    """Write ``path`` (.pvd) and a ``.vtu`` for each frame that was solved."""
    series = Series(path)
    body = pressed.bodies.body
    for frame in pressed.solved.frames:
        instant = Instant(1.0, frame.displacement, np.asarray(frame.reactions), frame.solves, 0, 0.0)
        series.add(frame.frame, body, instant)
