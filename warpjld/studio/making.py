"""Running a script and solving its contact in the background, on a copy of the scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.script.contact import check_contact, run_contact
from warpjld.script.runner import run_scene
from warpjld.script.scene import Scene
from warpjld.script.staging import frame_numbers

if TYPE_CHECKING:
    from warpjld.simulation.report.table import ContactRow
    from warpjld.simulation.simulate import Simulation
    from warpjld.studio.background import JobProgress

__all__ = ["Pressed", "made", "pressed"]


@dataclass(frozen=True, eq=False)
class Pressed:
    """A solved contact.

    Attributes:
        text: The script that was solved.
        scene: Its scene, including keys that grip searches found.
        simulation: The result.
    """

    text: str
    scene: Scene
    simulation: Simulation

    def rows(self, frame: float) -> list[ContactRow]:
        """Contacts at the nearest solved frame."""
        every = self.simulation.rows
        near = min({row.frame for row in every}, key=lambda one: abs(one - frame), default=frame)
        return [row for row in every if row.frame == near and row.force_n > 0.0]


def pressed(text: str, scene: Scene, progress: JobProgress) -> Pressed:
    """Solve the contact that PRESS specifies.

    Raises:
        InputError: There is no PRESS, or bodies that cannot be meshed or driven.
    """
    if scene.contact.pressing is None:
        raise InputError("nothing to solve: add a line such as PRESS 0 20 after FLESH or PHYSICAL")
    check_contact(scene, [], frame_numbers(scene))
    return Pressed(text, scene, run_contact(scene, scene.folder, progress))


def made(scene: Scene, script: Path, progress: JobProgress, device: str = "cpu") -> dict[str, Any]:
    """Write the script's files into the output folder; the summary."""
    return run_scene(scene, scene.folder, script=script, device=device, progress=progress)
