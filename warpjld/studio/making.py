"""Running a script and solving its contact in the background, on a copy of the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.script.contact import check_contact, run_contact
from warpjld.script.runner import run_scene
from warpjld.script.scene import Scene
from warpjld.script.staging import frame_numbers
from warpjld.skeleton.channels import FLEXION
from warpjld.studio.key_lines import with_keys

if TYPE_CHECKING:
    from warpjld.simulation.display.surfaces import DeformedSurfaces
    from warpjld.simulation.report.table import ContactRow, JointOpening
    from warpjld.simulation.simulate import Simulation
    from warpjld.studio.background import JobProgress
    from warpjld.studio.state import StudioState

__all__ = ["Pressed", "made", "open_joints", "pressed"]


@dataclass(frozen=True, eq=False)
class Pressed:
    """A solved contact.

    Attributes:
        text: The script that was solved.
        scene: Its scene, including keys that grip searches found.
        surfaces: Visible surfaces of the solved frames.
        simulation: The result; None while frames are being solved.
    """

    text: str
    scene: Scene
    surfaces: DeformedSurfaces
    simulation: Simulation | None = None

    def rows(self, frame: float) -> list[ContactRow]:
        """Contacts at the nearest solved frame."""
        every = [] if self.simulation is None else self.simulation.rows
        near = min({row.frame for row in every}, key=lambda one: abs(one - frame), default=frame)
        return [row for row in every if row.frame == near and row.force_n > 0.0]


def pressed(
    text: str,
    scene: Scene,
    progress: JobProgress,
    showing: Callable[[Pressed], None] = lambda pressed: None,
) -> Pressed:
    """Solve the contact that PRESS specifies; ``showing`` is called after each frame.

    Raises:
        InputError: There is no PRESS, or bodies that cannot be meshed or driven.
    """
    if scene.contact.pressing is None:
        raise InputError("nothing to solve: add a line such as PRESS 0 20 after FLESH or PHYSICAL")
    check_contact(scene, [], frame_numbers(scene))
    found = run_contact(scene, scene.folder, progress, showing=lambda surfaces: showing(Pressed(text, scene, surfaces)))
    return Pressed(text, scene, found.surfaces, found)


def open_joints(state: StudioState, openings: Sequence[JointOpening]) -> bool:
    """Open the joints that a verdict suggests, each at its frame; returns False if the script could not be changed."""
    text, current = state.document.text, state.scene.current
    for one in openings:
        channel = f"{one.joint}.flexion"
        actor = state.scene.actor(one.actor)
        degrees = math.degrees(actor.value(channel, one.frame)) - one.degrees
        low = math.degrees(float(actor.skeleton.limits[actor.skeleton.index(one.joint), FLEXION, 0]))
        speak = None if current == actor.name else actor.name
        text = with_keys(text, {channel: max(degrees, low)}, one.frame, actor=speak)
        current = actor.name
    return state.put(text)


def made(scene: Scene, script: Path, progress: JobProgress, device: str = "cpu") -> dict[str, Any]:
    """Write the script's files into the output folder; the summary."""
    return run_scene(scene, scene.folder, script=script, device=device, progress=progress)
