"""Messages about bonds that break during a simulation (R93, R102)."""

from __future__ import annotations

from collections.abc import Sequence

from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["parted_notes"]


def parted_notes(model: ContactModel, frames: Sequence[SolvedFrame], start: float) -> list[str]:
    """Messages about bonds that break wholly or in part, with the frames between which they do.

    Args:
        model: The contact model.
        frames: Solved frames.
        start: Number of the frame before the first of them.
    """
    out = []
    for k, (pair, owner) in enumerate(zip(model.pairs, model.owners, strict=True)):
        if pair.bond is None:
            continue
        since, left = start, 1.0
        for frame in frames:
            now = float(frame.bonded[k])
            if now < left:
                names = f"{owner.slave} and {owner.master}"
                when = f"between frames {since:g} and {frame.frame:g}"
                much = "wholly" if now == 0.0 else f"in part: {100 * now:.0f} % of their bond still holds"
                out.append(f"{names} part {when} {much}")
            since, left = frame.frame, now
    return out
