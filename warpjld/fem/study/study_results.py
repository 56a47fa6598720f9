"""Results of a study in a folder: a ParaView series, a table of reactions and pictures, complete at every instant."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.output.vtk import Series
from warpjld.fem.study.study import FemStudy, StudyInstant
from warpjld.files.whole_file import whole_file

__all__ = ["Reaction", "StudyResults"]


@dataclass(frozen=True, eq=False)
class Reaction:
    """Sum of the reactions at a set at an instant.

    Attributes:
        step: The step's name.
        load: Load factor.
        where: Name of the set.
        force: The sum [N], shape (3,).
    """

    step: str
    load: float
    where: str
    force: Array


class StudyResults:
    """Writer of results as equilibria are found, so that an interrupted study leaves complete files.

    Args:
        study: The study.
        folder: Output folder, which must exist.
        name: File name of the series, without suffix.
        pictures: Whether to draw displacement and stress after each step.
    """

    def __init__(self, study: FemStudy, folder: Path, name: str, *, pictures: bool = True) -> None:
        self.study = study
        self.folder = folder
        self.reactions: list[Reaction] = []
        self.files: list[Path] = []
        self.last: StudyInstant | None = None
        self._series = Series(folder / f"{name}.pvd")
        self._pictures = pictures

    def add(self, reached: StudyInstant) -> None:
        """Write an equilibrium; with the first of a new step, draw the previous step."""
        if self.last is not None and self.last.step is not reached.step:
            self._draw(self.last)
        if self.last is None:
            self.files += [self._series.path, self.folder / "reactions.csv"]
        self.files.append(self._series.add(reached.time, self.study.body, reached.instant))
        forces = reached.instant.reactions.reshape(-1)
        for where, degrees in reached.held.items():
            force = np.array([forces[degrees[degrees % 3 == axis]].sum() for axis in range(3)])
            self.reactions.append(Reaction(reached.step.name, reached.instant.factor, where, force))
        self._write_reactions()
        self.last = reached

    def finish(self) -> None:
        """Draw the last step."""
        if self.last is not None:
            self._draw(self.last)

    def content(self) -> dict[str, Any]:
        """All results as plain values, for JSON."""
        mesh = self.study.body.mesh
        return {
            "title": self.study.title,
            "elements": len(mesh.elements),
            "degrees_of_freedom": self.study.body.degrees,
            "least_scaled_jacobian": float(mesh.scaled_jacobian().min()),
            "converged": self.last is not None and self.last.solution.converged,
            "message": "" if self.last is None else self.last.solution.message,
            "reactions": [
                {"step": row.step, "load": row.load, "where": row.where, "newton": row.force.tolist()}
                for row in self.reactions
            ],
            "files": [str(file) for file in self.files],
        }

    def _draw(self, reached: StudyInstant) -> None:
        if not self._pictures:
            return
        from warpjld.fem.output.pictures import QUANTITIES, draw

        for quantity in QUANTITIES:
            path = self.folder / f"{reached.step.name.replace(' ', '-')}_{quantity}.png"
            draw(path, self.study.body, reached.instant, quantity, f"{self.study.title}: {reached.step.name}")
            self.files.append(path)

    def _write_reactions(self) -> None:
        with whole_file(self.folder / "reactions.csv") as part, part.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["step", "load", "where", "rx_newton", "ry_newton", "rz_newton"])
            writer.writerows([row.step, row.load, row.where, *row.force] for row in self.reactions)
