"""What a script asks for made, and its contact solved: on a scene of their own, beside the one that is edited."""

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
        text: The script that it is of.
        scene: Its scene, with the keys that grips were found to have.
        simulation: What came of it.
    """

    text: str
    scene: Scene
    simulation: Simulation

    def rows(self, frame: float) -> list[ContactRow]:
        """What touches at the solved frame that is nearest."""
        every = self.simulation.rows
        near = min({row.frame for row in every}, key=lambda one: abs(one - frame), default=frame)
        return [row for row in every if row.frame == near and row.force_n > 0.0]


def pressed(text: str, scene: Scene, progress: JobProgress) -> Pressed:
    """Do what PRESS asks for.

    Raises:
        InputError: There is no PRESS, or bodies that cannot be meshed or driven.
    """
    if scene.contact.pressing is None:
        raise InputError("nothing to solve: add a line such as PRESS 0 20 after FLESH or PHYSICAL")
    check_contact(scene, [], frame_numbers(scene))
    return Pressed(text, scene, run_contact(scene, scene.folder, progress))


def made(scene: Scene, script: Path, progress: JobProgress, device: str = "cpu") -> dict[str, Any]:
    """Make the script's files in the output folder; the summary."""
    return run_scene(scene, scene.folder, script=script, device=device, progress=progress)
