"""Ways to take an object, found beside the studio: each is a command of the script, with the scene that it leads to."""

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
    """One way.

    Attributes:
        line: The command.
        text: The script with it.
        outcome: What the search says of it.
        performance: Of the script with it.
    """

    line: str
    text: str
    outcome: Attempt
    performance: Performance

    @property
    def scene(self) -> Scene:
        """The scene with it."""
        return self.performance.scene

    @property
    def title(self) -> str:
        """Posture, score and what touches, in a line."""
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
    """Search with every posture; the best score first.

    Args:
        performance: Of the script as it is: each search goes on from a copy.
        path: The script's file.
        text: The script.
        line: ``GRASP … AUTO``, without a posture.
        progress: Told which posture is looked at.
        found: Told of each way as it is found.

    Raises:
        InputError: No posture leads to a grasp; says why the last does not.
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
