"""A scene made: all that can be wrong is looked at first, then everything it asks for is made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
    """Make everything a scene asks for; if it asks for nothing, an animated surface, a film and a contact sheet.

    Args:
        scene: What the script described.
        folder: Where to; made if missing. Files appear in it when all that can be made are complete.
        script: Named in the summary.
        device: Warp device of the covering.
        threads: CPU threads of the covering; None leaves the choice to it.
        dry: Check everything that can be checked, but compute and write nothing.
        page: Make a page (HTML) of the animation, too, in the colours of pressure where contact is solved.
        progress: Told about the work as it goes.

    Returns:
        The summary, also written as ``summary.json``: plain values, see ``Summary``.

    Raises:
        InputError: Nobody on stage, a key beyond a limit, a folder that cannot be written.
        WarpjldError: Some output could not be made; all others are in the folder, and the summary names it.
        MissingExtraError: A format needs an optional dependency.
    """
    if not scene.props:
        scene.actor()  # says what to do where there is none
    frames = frame_numbers(scene)
    summary = Summary(scene, frames, script, device)
    outputs = _wanted(scene, summary, page, script)
    checked_device(device)
    _check_outputs(scene, outputs, folder, script, len(frames))
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
        if made.failures.found and not unsolved:  # else contact is why, and the summary names what could not be made
            raise WarpjldError(
                f"not made: {'; '.join(made.failures.lines())}; all else that was asked for is in {folder}"
            )
        if made.contact is not None and made.contact.solved.interrupted:
            raise made.unsolved(made.contact)
    if made.contact is not None and unsolved:
        raise made.unsolved(made.contact)
    return content


def _wanted(scene: Scene, summary: Summary, page: bool, script: Path | None) -> list[Output]:
    """What was asked for, or what a run makes by itself; tables of contact always."""
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
    """Before anything is computed: formats, names, what stands in the way, room, lengths."""
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
    """Refuse clips and rates that a format does not take."""
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


def _size(scene: Scene, outputs: Sequence[Output], frames: int) -> float:
    """About how many bytes the outputs are; films and pictures are small beside what is exported."""
    size = 0.0
    for output in outputs:
        if isinstance(output, Export):
            size += sum(12.0 * frames * len(actor.rig.surface.weld) for actor in actors_of(output, scene))
        elif isinstance(output, Picture | ContactSheet):
            size += 0.1 * scene.size[0] * scene.size[1]
    return size
