"""Accuracy of a baked rig against its covering on test poses, compared with painted weights; as CSV or JSON."""

from __future__ import annotations

import csv
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.baking.baked import Baked
from warpjld.baking.poses import NamedPoses
from warpjld.covering.baselines import linear_blend_skinning
from warpjld.covering.covering import Covering
from warpjld.errors import InputError
from warpjld.files.whole_file import whole_file

__all__ = ["REPORTS", "Accuracy", "accuracy", "check_report", "write_report"]

REPORTS = (".csv", ".json")
"""Suffixes of reports."""

_MM = 1000.0  # millimetres per metre
_FRAMES = 16  # frames measured at once, which bounds memory


@dataclass(frozen=True)
class Accuracy:
    """Distances [mm] from the covering over all vertices and poses of one name; None where a method does not apply.

    Attributes:
        poses: Name of the poses, ``all`` for all together.
        frames: Number of poses.
        painted_rms: RMS distance with the rig's painted weights.
        painted_largest: Largest distance with them.
        weights_rms: RMS distance with the fitted weights alone.
        weights_largest: Largest distance with them.
        corrected_rms: RMS distance with fitted weights and corrective shapes.
        corrected_largest: Largest distance with them.
    """

    poses: str
    frames: int
    painted_rms: float | None
    painted_largest: float | None
    weights_rms: float
    weights_largest: float
    corrected_rms: float | None
    corrected_largest: float | None


def accuracy(baked: Baked, covering: Covering, unseen: NamedPoses) -> list[Accuracy]:
    """Accuracy over all poses, then over those of each name.

    Args:
        baked: The baked rig.
        covering: The covering it was fitted to.
        unseen: Test poses.
    """
    rig, poses = baked.rig, unseen.poses
    found: dict[str, list[NDArray[np.float64]]] = {"weights": []}
    if rig.skin is not None:
        found["painted"] = []
    if len(baked.correctives):
        found["corrected"] = []
    for start in range(0, len(poses), _FRAMES):
        part = poses[start : start + _FRAMES]
        wanted = covering.deform(part).astype(np.float64)

        def squared_distances(got: NDArray[np.float64], wanted: NDArray[np.float64] = wanted) -> NDArray[np.float64]:
            """Mean and largest squared distance of every frame [m²], shape (f, 2)."""
            square = ((got - wanted) ** 2).sum(axis=-1)
            return np.column_stack([square.mean(axis=1), square.max(axis=1)])

        found["weights"].append(squared_distances(baked.deform(part, corrected=False)))
        if "corrected" in found:
            found["corrected"].append(squared_distances(baked.deform(part)))
        if rig.skin is not None:
            painted = linear_blend_skinning(rig.skeleton, rig.surface.vertices, rig.skin, part)
            found["painted"].append(squared_distances(painted))
    squares = {kind: np.concatenate(rows) for kind, rows in found.items()}
    names = np.array(unseen.names)
    return [_row(name, names == name if n else np.ones(len(names), bool), squares) for n, name in _named(unseen)]


def _named(unseen: NamedPoses) -> list[tuple[int, str]]:
    """Numbered names of the rows, ``all`` first."""
    return list(enumerate(["all", *dict.fromkeys(unseen.names)]))


def _row(name: str, frames: NDArray[np.bool_], squares: dict[str, NDArray[np.float64]]) -> Accuracy:
    """Accuracy over the frames of a mask, from mean and largest squared distances (F, 2) of each method."""

    def of(kind: str) -> tuple[float, float] | tuple[None, None]:
        if kind not in squares:
            return None, None
        mean, largest = squares[kind][frames].T
        return _MM * float(np.sqrt(mean.mean())), _MM * float(np.sqrt(largest.max()))

    painted, corrected = of("painted"), of("corrected")
    mean, largest = of("weights")
    assert mean is not None
    assert largest is not None
    return Accuracy(name, int(frames.sum()), painted[0], painted[1], mean, largest, corrected[0], corrected[1])


def check_report(path: Path) -> None:
    """Raise InputError for a suffix that is not among ``REPORTS``."""
    if path.suffix.lower() not in REPORTS:
        raise InputError(f"unknown kind of report '{path.suffix}'; known: {', '.join(REPORTS)}", path=path)


def write_report(path: Path, rows: list[Accuracy]) -> None:
    """Write rows as CSV or JSON, by the suffix; millimetres.

    Raises:
        InputError: Another suffix, or a file that cannot be written.
    """
    check_report(path)
    records = [{k: round(v, 6) if isinstance(v, float) else v for k, v in asdict(row).items()} for row in rows]
    try:
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
            if path.suffix.lower() == ".json":
                json.dump({"unit": "mm", "unseen": records}, file, indent=1)
            else:
                table = csv.DictWriter(file, list(records[0]))
                table.writeheader()
                table.writerows(records)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error
