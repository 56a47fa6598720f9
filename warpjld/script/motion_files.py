"""Motion files of actors, on the joints of their rigs' own files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.script.failures import Failures
from warpjld.script.folder import OutputFolder
from warpjld.script.outputs import MotionFile, Output
from warpjld.script.per_actor import actors_of, file_of

if TYPE_CHECKING:
    from warpjld.script.crowd import Crowd
    from warpjld.script.scene import Scene

__all__ = ["write_motions"]


def write_motions(
    scene: Scene,
    crowd: Crowd,
    frames: NDArray[np.float64],
    outputs: Sequence[Output],
    out: OutputFolder,
    failures: Failures,
) -> list[str]:
    """Write the motion files among the outputs, at frames (F,); returns notes, and warns through the scene."""
    from warpjld.motion.out import write_motion

    notes: list[str] = []
    for output in outputs:
        if not isinstance(output, MotionFile):
            continue
        shown = [actor.name for actor in actors_of(output, scene)]
        for role in crowd.roles:
            if role.actor.name not in shown:
                continue
            name = file_of(output, role.actor, scene)
            place = out.place(name)
            with failures.kept(name, place):
                written = write_motion(
                    place,
                    role.actor.rig,
                    role.poses,
                    rate=scene.rate,
                    start_frame=int(frames[0]),
                    name=role.actor.name.lower(),
                )
                notes += [f"{name}: {note}" for note in written.notes]
                scene.warned(f"{name}: {warning}" for warning in written.warnings)
    return notes
