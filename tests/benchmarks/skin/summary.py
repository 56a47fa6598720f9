"""One line for each rig and method: the whole matrix in short."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tests.benchmarks.skin.measures import Measured

__all__ = ["summary"]

HEAD = (
    "rig",
    "method",
    "poses",
    "volume: mean, worst [%]",
    "limb: mean, worst [%]",
    "stretch: least, largest",
    "folds",
    "contact",
    "roughness [°]",
    "ms",
)


def summary(rows: Iterable[tuple[str, str, str, Measured, float]]) -> list[str]:
    """A Markdown table of rows of rig, pose, method, measured and milliseconds.

    Means of volumes are of their sizes; stretch is the least and largest of all poses; folds are faces that cross
    within a part or at a joint, contact all others, both summed over poses; roughness is the root of the mean square.
    """
    groups: dict[tuple[str, str], list[tuple[Measured, float]]] = {}
    for rig, _, method, measured, took in rows:
        groups.setdefault((rig, method), []).append((measured, took))
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    for (rig, method), some in groups.items():
        found = [m for m, _ in some]
        cells = [
            rig,
            method,
            str(len(found)),
            *(_volumes([getattr(m, name) for m in found]) for name in ("volume", "limb")),
            f"{min(m.least for m in found):.2f}, {max(m.largest for m in found):.2f}",
            str(sum(m.joint for m in found)),
            str(sum(m.digits + m.palm + m.other for m in found)),
            f"{np.sqrt(np.mean([m.roughness**2 for m in found])):.2f}",
            f"{np.median([took for _, took in some]):.1f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _volumes(changes: list[float]) -> str:
    known = [c for c in changes if np.isfinite(c)]
    if not known:
        return "–"
    return f"{np.mean(np.abs(known)):.1f}, {max(known, key=abs):+.1f}"
