"""Making the outputs of a scene: everything that can be checked is checked first, then the outputs are made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld import render
from warpjld.covering.device import checked_device
from warpjld.errors import InputError, WarpjldError
from warpjld.files.names import folded
from warpjld.files.overwriting import check_outputs
from warpjld.motion.out import check_motion_out
from warpjld.script.contact import check_contact
from warpjld.script.destinations import check_destinations
from warpjld.script.directing import shot_at
from warpjld.script.formats import PAGE, check_available, video_is_available
from warpjld.script.kept_contact import contact_kept
from warpjld.script.making import Making, Report, cast, exported_props, prop_export_name
from warpjld.script.outputs import ContactSheet, Export, FilmOutput, Grips, MotionFile, Output, Picture, Table
from warpjld.script.per_actor import actors_of, file_of
from warpjld.script.scene import Scene
from warpjld.script.staging import frame_numbers, held, notes, stage
from warpjld.script.summary import Summary
from warpjld.simulation.specification import located

__all__ = ["Report", "cast", "run_scene"]


def run_scene(
    scene: Scene,
    folder: Path,
    *,
    script: Path | None = None,
    device: str = "cpu",
    threads: int | None = None,
    dry: bool = False,
    page: bool = False,
    progress: Report = lambda what, done, total: None,
) -> dict[str, Any]:
    """Make the outputs of a scene; if there are none, an animated surface, a film and a contact sheet.

    Args:
        scene: The scene.
        folder: Output folder; made if missing. Files appear in it when all that can be made are complete.
        script: The script file, which the summary names.
        device: Warp device of the covering.
        threads: CPU threads of the covering; None: chosen automatically.
        dry: Check everything that can be checked, but compute and write nothing.
        page: Also write the animation as an HTML page, coloured by pressure where contact is solved.
        progress: Called with a stage's name, steps done and steps in total.

    Returns:
        The summary, as JSON values, see ``Summary``; it is also written as ``summary.json``.

    Raises:
        InputError: A scene without actors, a key beyond a limit, a folder that cannot be written.
        WarpjldError: Some output could not be made; all others are in the folder, and the summary names it.
        MissingExtraError: A format needs an optional dependency.
    """
    if not scene.props:
        scene.actor()  # raises an error with advice if there is none
    frames = frame_numbers(scene)
    summary = Summary(scene, frames, script, device)
    outputs = _wanted(scene, summary, page, script)
    checked_device(device)
    _check_outputs(scene, outputs, folder, script, len(frames))
    summary.notes += _cut_shots(outputs, frames)
    summary.notes += check_contact(scene, outputs, frames)
    for actor in scene.actors.values():
        stage(actor, frames[:1], scene.rate)  # keys beyond limits are found here
        summary.notes += notes(actor, frames)
        scene.warned(line for line in held(actor, frames, scene.rate) if line not in scene.warnings)
    if dry:
        return summary.content([{"name": name} for name in _names(scene, outputs)], folder)
    with contact_kept(scene, folder) as keeping:
        made = Making(scene, folder, frames, outputs, summary, device, threads, progress, script, keeping)
        content = made.all()
        unsolved = made.contact is not None and made.contact.verdict.failed
        if made.failures.found and not unsolved:  # otherwise the error about contact is raised, which is the cause
            raise WarpjldError(f"not made: {'; '.join(made.failures.lines())}; all other outputs are in {folder}")
        if made.contact is not None and made.contact.solved.interrupted:
            raise made.unsolved(made.contact)
    if made.contact is not None and unsolved:
        raise made.unsolved(made.contact)
    return content


def _wanted(scene: Scene, summary: Summary, page: bool, script: Path | None) -> list[Output]:
    """The scene's outputs, or the default ones; with tables of contact where it is solved."""
    outputs = list(scene.outputs)
    if not outputs:
        outputs = [Export("surface.npz", None), ContactSheet("contact.png", (), scene.camera)]
        video = video_is_available()
        outputs.insert(1, FilmOutput("film.mp4" if video else "film.gif", "shaded", scene.camera))
        if not video:
            summary.notes.append("the film is a GIF; for MP4: pip install 'warpjld[film]'")
    if page:
        name = "film.html" if script is None else f"{script.stem}.html"
        outputs.append(FilmOutput(name, "shaded" if scene.contact.pressing is None else "pressure", scene.camera))
    if scene.contact.pressing is not None and not any(isinstance(output, Table) for output in outputs):
        outputs.append(Table("contact.csv"))
    if scene.contact.pressing is not None and scene.contact.grips:
        outputs.append(Grips("grips.csv"))
    return outputs


def _check_outputs(scene: Scene, outputs: list[Output], folder: Path, script: Path | None, count: int) -> None:
    """Check, before anything is computed: formats, names, files that would be overwritten, disk space, lengths."""
    check_available([output.name for output in outputs])
    for output in outputs:
        if isinstance(output, MotionFile):
            check_motion_out(output.name)
    read = scene.read if script is None else [*scene.read, script]
    names = _names(scene, outputs)
    if "summary.json" in map(folded, names):
        raise InputError("'summary.json' is the name of the summary that every run writes")
    check_outputs([folder / name for name in names], read)
    check_destinations(folder, [*names, "summary.json"], _size(scene, outputs, count))
    _check_lengths(scene, outputs, count)


def _names(scene: Scene, outputs: Sequence[Output]) -> list[str]:
    """Names of all files that the outputs make."""
    names = []
    for output in outputs:
        if isinstance(output, Export | MotionFile):
            names += [file_of(output, actor, scene) for actor in actors_of(output, scene)]
            if isinstance(output, Export):
                names += [prop_export_name(output, prop) for prop in exported_props(output, scene)]
        else:
            names.append(output.name)
    return names


def _check_lengths(scene: Scene, outputs: Sequence[Output], frames: int) -> None:
    """Refuse numbers of frames and rates that a format does not support."""
    from warpjld.io.caches import open_cache

    for output in outputs:
        try:
            if isinstance(output, FilmOutput) and not output.name.lower().endswith(PAGE):
                render.Film(output.name, rate=scene.rate)
                if output.shots and not any(shot_at(output.shots, frame) for frame in frame_numbers(scene)):
                    raise InputError("none of its shots has a frame that is made: see FRAMES")
            for actor in actors_of(output, scene) if isinstance(output, Export) else ():
                open_cache(output.name, actor.rig.surface, frames=frames, rate=scene.rate)
        except InputError as error:
            raise located(InputError(f"'{output.name}': {error.message}"), scene.asked.get(output.name)) from None


def _cut_shots(outputs: Sequence[Output], frames: NDArray[np.float64]) -> list[str]:
    """Notes on shots of which frames are not made."""
    shots = {shot.name: shot for output in outputs if isinstance(output, FilmOutput) for shot in output.shots}
    first, last = float(frames[0]), float(frames[-1])
    return [
        f"SHOT {name} has frames {shot.first:g} to {shot.last:g}, of which only those from {first:g} to {last:g} are "
        "made: see FRAMES"
        for name, shot in shots.items()
        if shot.first < first or shot.last > last
    ]


def _size(scene: Scene, outputs: Sequence[Output], frames: int) -> float:
    """Estimated size of the outputs [bytes]; films are neglected."""
    size = 0.0
    for output in outputs:
        if isinstance(output, Export):
            size += sum(12.0 * frames * len(actor.rig.surface.weld) for actor in actors_of(output, scene))
        elif isinstance(output, Picture | ContactSheet):
            size += 0.1 * scene.size[0] * scene.size[1]
    return size
