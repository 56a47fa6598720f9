"""A scene made: bind → poses → deform, block after block, into exports, films and pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld import render
from warpjld.covering.device import checked_device
from warpjld.errors import InputError, WarpjldError
from warpjld.files.names import folded
from warpjld.files.overwriting import check_outputs
from warpjld.motion.out import check_motion_out
from warpjld.script.contact import check_contact, run_contact, write_contact
from warpjld.script.crowd import Crowd, role_of
from warpjld.script.destinations import check_destinations
from warpjld.script.failures import Failures, Writer
from warpjld.script.folder import OutputFolder
from warpjld.script.formats import check_available, video_is_available
from warpjld.script.grasping import contact_reports
from warpjld.script.motion_files import write_motions
from warpjld.script.outputs import ContactSheet, Export, FilmOutput, Grips, MotionFile, Output, Picture, Table
from warpjld.script.per_actor import actors_of, file_of
from warpjld.script.pictures import FilmStudio, PressureStudio, draw_contact_sheet, draw_picture, film_studio
from warpjld.script.props import Prop, prop_places, prop_surface
from warpjld.script.scene import Scene
from warpjld.script.staging import frame_numbers, held, notes, stage
from warpjld.script.summary import Summary
from warpjld.simulation.specification import located

if TYPE_CHECKING:
    from warpjld.geometry.surface import Surface
    from warpjld.io.caches import Cache

__all__ = ["Report", "cast", "run_scene"]

_BLOCK = 16  # frames deformed at once: memory does not grow with the length of the film

Report = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and how much there is."""


def run_scene(
    scene: Scene,
    folder: Path,
    *,
    script: Path | None = None,
    device: str = "cpu",
    threads: int | None = None,
    dry: bool = False,
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
        progress: Told about the work as it goes.

    Returns:
        The summary, also written as ``summary.json``: plain values, see ``Summary``.

    Raises:
        InputError: Nobody on stage, a key beyond a limit, a folder that cannot be written.
        WarpjldError: Some output could not be made; all others are in the folder, and the summary names it.
        MissingExtraError: A format needs an optional dependency.
    """
    scene.actor()  # says what to do where there is none
    frames = frame_numbers(scene)
    summary = Summary(scene, frames, script, device)
    outputs = _wanted(scene, summary)
    checked_device(device)
    _check_outputs(scene, outputs, folder, script, len(frames))
    summary.notes += check_contact(scene, outputs, frames)
    for actor in scene.actors.values():
        stage(actor, frames[:1], scene.rate)  # keys beyond limits are found here
        summary.notes += notes(actor, frames)
        scene.warned(line for line in held(actor, frames, scene.rate) if line not in scene.warnings)
    if dry:
        return summary.content([{"name": name} for name in _names(scene, outputs)], folder)
    failures = Failures()
    with OutputFolder(folder) as out:
        with summary.timed("bind"):
            crowd = cast(scene, frames, device=device, progress=progress)
        simulated = None
        if scene.contact.pressing is not None:
            with summary.timed("contact"):
                simulated = run_contact(scene, folder, progress)
            crowd = replace(cast(scene, frames, device=device), pressed=simulated.surfaces)
            summary.press = simulated.verdict.content() | {"searches": [one.content() for one in simulated.grips]}
            summary.notes += simulated.notes
        with summary.timed("frames"):
            _make_sequences(scene, crowd, frames, outputs, out, threads, progress, failures)
        summary.notes += write_motions(scene, crowd, frames, outputs, out, failures)
        if simulated is not None:
            for output in outputs:
                with failures.kept(output.name, out.place(output.name)):
                    write_contact(simulated, [output], out)
        if scene.props:
            with summary.timed("contacts"):
                summary.contacts = contact_reports(scene, crowd)
        with summary.timed("pictures"):
            _make_pictures(scene, crowd, outputs, out, progress, "" if script is None else script.stem, failures)
        for role in crowd.roles:
            scene.warned(f"{role.actor.name}: {line}" for line in (role.contact.messages() if role.contact else ()))
        if failures.found and not out.made():
            if len(failures.found) == 1:
                (name,) = failures.found
                raise located(InputError(failures.lines()[0]), scene.asked.get(name))
            raise WarpjldError("; ".join(failures.lines()))
        summary.failed = failures.found
        content = summary.write(out)
    if simulated is not None and simulated.verdict.failed:
        frames_told = simulated.verdict.frames
        kept = "no frame" if frames_told is None else f"frames {frames_told[0]:g} to {frames_told[1]:g}"
        raise located(
            InputError(f"contact was not solved: {simulated.verdict.text}; {kept} and all files are in {folder}"),
            scene.contact.pressing.where if scene.contact.pressing is not None else None,
        )
    if failures.found:
        raise WarpjldError(f"not made: {'; '.join(failures.lines())}; all else that was asked for is in {folder}")
    return content


def _wanted(scene: Scene, summary: Summary) -> list[Output]:
    """What was asked for, or what a run makes by itself; tables of contact always."""
    outputs = list(scene.outputs)
    if not outputs:
        outputs = [Export("surface.npz", None), ContactSheet("contact.png", (), scene.camera)]
        video = video_is_available()
        outputs.insert(1, FilmOutput("film.mp4" if video else "film.gif", "shaded", scene.camera))
        if not video:
            summary.notes.append("the film is a GIF; for MP4: pip install 'warpjld[film]'")
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


def cast(
    scene: Scene,
    frames: NDArray[np.float64],
    *,
    device: str = "cpu",
    progress: Report = lambda what, done, total: None,
) -> Crowd:
    """Bind every actor's surface and pose it at these frames."""
    roles = []
    for number, actor in enumerate(scene.actors.values()):
        progress(f"binding {actor.name.lower()}", number, len(scene.actors))
        roles.append(role_of(actor, frames, scene.rate))
    return Crowd(roles, frames, device, list(scene.props.values()), partial(prop_places, scene.actors, scene.rate))


def _names(scene: Scene, outputs: Sequence[Output]) -> list[str]:
    names = []
    for output in outputs:
        if isinstance(output, Export | MotionFile):
            names += [file_of(output, actor, scene) for actor in actors_of(output, scene)]
            if isinstance(output, Export):
                names += [_prop_export_name(output, prop) for prop in _exported_props(output, scene)]
        else:
            names.append(output.name)
    return names


def _exported_props(export: Export, scene: Scene) -> list[Prop]:
    """Objects go along where all actors are exported."""
    return list(scene.props.values()) if export.actor is None else []


def _prop_export_name(export: Export, prop: Prop) -> str:
    path = PurePosixPath(export.name)
    return str(path.with_name(f"{path.stem}-{prop.name.lower()}{path.suffix}"))


def _make_sequences(
    scene: Scene,
    crowd: Crowd,
    frames: NDArray[np.float64],
    outputs: Sequence[Output],
    out: OutputFolder,
    threads: int | None,
    progress: Report,
    failures: Failures,
) -> None:
    """Exports and films, in one pass over the frames."""
    from warpjld.io.caches import open_cache

    def cache_of(name: str, surface: Surface, label: str) -> Writer[Cache]:
        place = out.place(name)
        timing: dict[str, Any] = {"frames": len(frames), "rate": scene.rate, "start_frame": int(frames[0])}
        return Writer(name, place, lambda: open_cache(place, surface, name=label.lower(), **timing), failures)

    def studio_of(film: FilmOutput) -> Writer[FilmStudio | PressureStudio]:
        place = out.place(film.name)
        return Writer(film.name, place, lambda: film_studio(scene, crowd, film, place), failures)

    exports = [output for output in outputs if isinstance(output, Export)]
    films = [output for output in outputs if isinstance(output, FilmOutput)]
    if not exports and not films:
        return
    with ExitStack() as stack:
        caches = [
            [
                stack.enter_context(
                    cache_of(file_of(export, role.actor, scene), role.actor.rig.surface, role.actor.name)
                )
                for export in exports
                if export.actor in (None, role.actor.name)
            ]
            for role in crowd.roles
        ]
        prop_caches = [
            [
                stack.enter_context(cache_of(_prop_export_name(export, prop), prop_surface(prop), prop.name))
                for export in exports
                if export.actor is None
            ]
            for prop in crowd.props
        ]
        studios = [stack.enter_context(studio_of(film)) for film in films]
        blocks = [
            role.covering.blocks(role.poses, frames=_BLOCK, device=crowd.device, threads=threads)
            for role in crowd.roles
        ]
        writers: list[Writer[Any]] = [*studios]
        writers += [writer for group in (*caches, *prop_caches) for writer in group]
        for parts in zip(*blocks, strict=True):
            if not any(writer.works for writer in writers):
                return
            start = parts[0][0]
            worn = [crowd.worn(role, v, start) for role, (_, v) in zip(crowd.roles, parts, strict=True)]
            for actor_caches, vertices in zip(caches, worn, strict=True):
                for cache in actor_caches:
                    cache.do(partial(_write, vertices=vertices))
            count = len(parts[0][1])
            for prop, places, object_caches in zip(crowd.props, crowd.places, prop_caches, strict=True):
                if object_caches:
                    moved = np.stack([crowd.prop_vertices(prop, places, start + k) for k in range(count)])
                for cache in object_caches:
                    cache.do(partial(_write, vertices=moved.astype(np.float32)))
            for k in range(count):
                progress("frames", start + k, len(frames))
                together = np.concatenate([vertices[k] for vertices in worn])
                for studio in studios:
                    studio.do(partial(_take, frame=start + k, vertices=together))


def _write(cache: Cache, vertices: NDArray[np.float32]) -> None:
    cache.write(vertices)


def _take(studio: FilmStudio | PressureStudio, frame: int, vertices: NDArray[np.float32]) -> None:
    studio.take(frame, vertices)


def _check_lengths(scene: Scene, outputs: Sequence[Output], frames: int) -> None:
    """Refuse clips and rates that a format does not take."""
    from warpjld.io.caches import open_cache

    for output in outputs:
        try:
            if isinstance(output, FilmOutput):
                render.Film(output.name, rate=scene.rate)
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


def _make_pictures(
    scene: Scene,
    crowd: Crowd,
    outputs: Sequence[Output],
    out: OutputFolder,
    progress: Report,
    title: str,
    failures: Failures,
) -> None:
    wanted = [output for output in outputs if isinstance(output, Picture | ContactSheet)]
    for number, output in enumerate(wanted):
        progress("pictures", number, len(wanted))
        path = out.place(output.name)
        with failures.kept(output.name, path):
            if isinstance(output, Picture):
                draw_picture(scene, crowd, output, path)
            else:
                draw_contact_sheet(scene, crowd, output, path, title)
