"""Export of the deformed volumes as a VTK series: displacement, reaction and stress (R95)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from warpjld.fem import Instant
from warpjld.fem.output.vtk import Series
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["write_volumes"]


def write_volumes(path: Path, model: ContactModel, frames: Sequence[SolvedFrame]) -> None:
    """Write ``path`` (.pvd) and one ``.vtu`` file per solved frame."""
    series = Series(path)
    for frame in frames:
        instant = Instant(1.0, frame.displacement, np.asarray(frame.reactions), frame.solves, 0, 0.0)
        series.add(frame.frame, model.body, instant)
