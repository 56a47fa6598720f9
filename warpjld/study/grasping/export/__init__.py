"""Export of a study's grasps for other programs: named joints and poses, or surfaces with contact maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from warpjld.errors import InputError
from warpjld.study.grasping.export.dexgraspbench import write_dexgraspbench
from warpjld.study.grasping.export.grasps import closed_trials, write_objects
from warpjld.study.grasping.export.isaac import write_isaac
from warpjld.study.grasping.export.meshes import write_meshes
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.shards import Shards

__all__ = ["KINDS", "export_grasps"]

KINDS = ("isaac", "dexgraspbench", "mesh")
"""Names of the export formats."""


def export_grasps(
    plan: GraspPlan, shards: Shards, folder: Path, kinds: Sequence[str], trials: Sequence[int] | None = None
) -> list[Path]:
    """Write the closed hands of a study and its objects, each format into a folder of its own.

    Args:
        plan: The study's plan.
        shards: Its trials.
        folder: Output folder.
        kinds: Formats, of ``KINDS``.
        trials: Numbers of trials; None for all that closed.

    Raises:
        InputError: An unknown kind, a trial that did not close, or none that did.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise InputError(f"export: want one of {', '.join(KINDS)}, got '{kind}'")
    found = closed_trials(plan, shards, trials)
    if not found:
        raise InputError("no trial of this study closed: there is nothing to export")
    files = write_objects(found, plan.measuring.density, folder / "objects")
    for kind in dict.fromkeys(kinds):
        match kind:
            case "isaac":
                files += write_isaac(found, folder / kind)
            case "dexgraspbench":
                files += write_dexgraspbench(found, folder / kind)
            case "mesh":
                files += write_meshes(found, plan.measuring, folder / kind)
    return files
