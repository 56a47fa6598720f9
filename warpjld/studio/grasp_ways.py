"""Search for alternative grasps of an object, one per posture, as a background job of the studio."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import InputError
from warpjld.grasp.postures import POSTURES
from warpjld.script.grasping import Attempt
from warpjld.script.scene import Scene
from warpjld.studio.background import JobProgress
from warpjld.studio.performance import Performance

__all__ = ["GraspWay", "find_ways"]


@dataclass(frozen=True, eq=False)
class GraspWay:
    """One grasp that was found.

    Attributes:
        line: ``GRASP`` command with the posture.
        text: The script with this line appended.
        outcome: Result of the search.
        performance: Run of the script with this line.
    """

    line: str
    text: str
    outcome: Attempt
    performance: Performance

    @property
    def scene(self) -> Scene:
        """Scene after the command."""
        return self.performance.scene

    @property
    def title(self) -> str:
        """Posture, score and number of touching digits, as one line."""
        values = self.outcome.values
        return f"{values['posture']}: {values['score']:.3f} N, {len(values['digits'])} digits"


def find_ways(
    performance: Performance,
    path: Path,
    text: str,
    line: str,
    progress: JobProgress,
    found: Callable[[GraspWay], object] = lambda way: None,
) -> list[GraspWay]:
    """Search for a grasp with every posture; returns those found, best score first.

    Args:
        performance: Run of the current script; each search continues from a copy.
        path: File of the script.
        text: Text of the script.
        line: Command ``GRASP … AUTO`` without a posture.
        progress: Receives the posture being searched.
        found: Called with each grasp as it is found.

    Raises:
        InputError: No posture leads to a grasp; the message is that of the last one.
    """
    ways: list[GraspWay] = []
    failure: InputError | None = None
    body = text.rstrip("\n")
    for number, posture in enumerate(POSTURES):
        progress(f"looking for a way to take it: {posture}", number, len(POSTURES))
        tried = f"{line} POSTURE {posture.upper()}"
        trial, whole = performance.beside(), f"{body}\n{tried}\n"
        try:
            trial.run(whole, path)
        except InputError as error:
            failure = error
            continue
        ways.append(GraspWay(tried, whole, trial.scene.attempts[-1], trial))
        found(ways[-1])
    if not ways and failure is not None:
        raise failure
    return sorted(ways, key=lambda way: -float(way.outcome.values["score"]))
