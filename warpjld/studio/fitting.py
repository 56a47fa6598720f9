"""The covering's parameters fitted to an actor, beside the studio; they become a file of the script's folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.script.binding import cover
from warpjld.script.scene import Scene

if TYPE_CHECKING:
    from warpjld.studio.background import JobProgress

__all__ = ["fit_skin"]


def fit_skin(
    scene: Scene, name: str, path: Path, progress: JobProgress, poses: int | None = None
) -> tuple[float, float]:
    """Fit, and write the parameter file; the loss before and after.

    Args:
        scene: With the actor.
        name: The actor.
        path: The file that ``PARAMETERS`` then reads.
        progress: Told about the work.
        poses: How many poses to fit to; all of the set by default.

    Raises:
        InputError: Nothing of the actor deforms, or the file cannot be written.
    """
    from warpjld.covering.calibrate import calibrate
    from warpjld.covering.parameters import save_parameters
    from warpjld.covering.pose_sets import calibration_poses

    actor = scene.actor(name)
    chosen = None if poses is None else calibration_poses(actor.skeleton, poses)
    found = calibrate(cover(actor), chosen, progress=progress)
    save_parameters(path, actor.skeleton, found.parameters)
    return float(found.loss[0]), float(found.loss[1])
