"""Calibration of an actor's covering parameters as a background job; the result is a file in the script's folder."""

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
    """Calibrate an actor's parameters and write them to a file.

    Args:
        scene: Scene with the actor.
        name: Name of the actor.
        path: Parameter file to write; the command ``PARAMETERS`` reads it.
        progress: Receives progress reports.
        poses: Number of calibration poses; by default the whole set.

    Returns:
        Loss before and after.

    Raises:
        InputError: No part of the actor deforms, or the file cannot be written.
    """
    from warpjld.covering.calibrate import calibrate
    from warpjld.covering.parameters import save_parameters
    from warpjld.covering.pose_sets import calibration_poses

    actor = scene.actor(name)
    chosen = None if poses is None else calibration_poses(actor.skeleton, poses)
    found = calibrate(cover(actor), chosen, progress=progress)
    save_parameters(path, actor.skeleton, found.parameters)
    return float(found.loss[0]), float(found.loss[1])
