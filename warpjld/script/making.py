"""Production of a scene's outputs: bind, pose and deform block by block; write exports, films and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, WarpjldError
from warpjld.script.contact import run_contact, write_contact
from warpjld.script.crowd import Crowd, role_of
from warpjld.script.failures import Failures, Writer
from warpjld.script.folder import OutputFolder
from warpjld.script.formats import PAGE
from warpjld.script.grasping import contact_reports
from warpjld.script.motion_files import write_motions
from warpjld.script.outputs import ContactSheet, Export, FilmOutput, Output, Picture
from warpjld.script.page_film import PageStudio, page_studio
from warpjld.script.per_actor import file_of
from warpjld.script.pictures import FilmStudio, PressureStudio, draw_contact_sheet, draw_picture, film_studio
from warpjld.script.props import Prop, prop_places, prop_surface
from warpjld.script.scene import Scene
from warpjld.script.summary import Summary
from warpjld.simulation.specification import located

if TYPE_CHECKING:
    from warpjld.geometry.surface import Surface
    from warpjld.io.caches import Cache
    from warpjld.simulation.simulate import Keep, Simulation

__all__ = ["Making", "Report", "cast", "exported_props", "prop_export_name"]

Studio = FilmStudio | PressureStudio | PageStudio
Report = Callable[[str, int, int], None]
"""Progress callback: name of the stage, steps done, steps in total."""


@dataclass(eq=False)
class Making:
    """State of a run that makes the outputs of a scene; arguments as for ``run_scene``.

    Attributes:
        keeping: Passed to ``simulate``, see ``contact_kept``.
        failures: Outputs that could not be made.
        contact: Result of PRESS, if there was one.
    """

    scene: Scene
    folder: Path
    frames: NDArray[np.float64]
    outputs: Sequence[Output]
    summary: Summary
    device: str
    threads: int | None
    progress: Report
    script: Path | None
    keeping: Callable[[Keep], None]
    failures: Failures = field(default_factory=Failures)
    contact: Simulation | None = None

    def all(self) -> dict[str, Any]:
        """Make all outputs; the summary's content."""
        scene, frames, outputs, failures, summary = self.scene, self.frames, self.outputs, self.failures, self.summary
        with OutputFolder(self.folder) as out:
            with summary.timed("bind"):
                crowd = cast(scene, frames, device=self.device, progress=self.progress)
            if scene.contact.pressing is not None:
                crowd = self._solved()
            with summary.timed("frames"):
                _make_sequences(scene, crowd, frames, outputs, out, self.threads, self.progress, failures)
            summary.notes += write_motions(scene, crowd, frames, outputs, out, failures)
            if self.contact is not None:
                for output in outputs:
                    with failures.kept(output.name, out.place(output.name)):
                        write_contact(self.contact, [output], out)
            if scene.props:
                with summary.timed("contacts"):
                    summary.contacts = contact_reports(scene, crowd)
            with summary.timed("pictures"):
                title = "" if self.script is None else self.script.stem
                _make_pictures(scene, crowd, outputs, out, self.progress, title, failures)
            for role in crowd.roles:
                scene.warned(f"{role.actor.name}: {line}" for line in (role.contact.messages() if role.contact else ()))
            if failures.found and not out.made():
                if len(failures.found) == 1:
                    (name,) = failures.found
                    raise located(InputError(failures.lines()[0]), scene.asked.get(name))
                raise WarpjldError("; ".join(failures.lines()))
            summary.failed = failures.found
            return summary.write(out)

    def _solved(self) -> Crowd:
        """Solve contact; the actors and objects with their deformed surfaces."""
        summary = self.summary
        with summary.timed("contact"):
            found = self.contact = run_contact(self.scene, self.folder, self.progress, self.keeping)
        summary.press = found.verdict.content() | {"searches": [grip.content() for grip in found.grips]}
        summary.notes += found.notes
        return replace(cast(self.scene, self.frames, device=self.device), pressed=found.surfaces)

    def unsolved(self, found: Simulation) -> InputError:
        """Error to raise where not all frames were solved, or a hand does not press or hold as asked."""
        from warpjld.simulation.report.verdict import SHORT

        solved = found.verdict.frames
        kept = "no frame" if solved is None else f"frames {solved[0]:g} to {solved[1]:g}"
        pressing = self.scene.contact.pressing
        what = "" if found.verdict.status == SHORT else "contact was not solved: "
        return located(
            InputError(f"{what}{found.verdict.text}; {kept} and all files are in {self.folder}"),
            None if pressing is None else pressing.where,
        )


def cast(
    scene: Scene,
    frames: NDArray[np.float64],
    *,
    device: str = "cpu",
    progress: Report = lambda what, done, total: None,
) -> Crowd:
    """Bind every actor's surface and pose it at frames (F,)."""
    roles = []
    for number, actor in enumerate(scene.actors.values()):
        progress(f"binding {actor.name.lower()}", number, len(scene.actors))
        roles.append(role_of(actor, frames, scene.rate))
    return Crowd(roles, frames, device, list(scene.props.values()), partial(prop_places, scene.actors, scene.rate))


def exported_props(export: Export, scene: Scene) -> list[Prop]:
    """Objects that an export includes: all of them where all actors are exported, else none."""
    return list(scene.props.values()) if export.actor is None else []


def prop_export_name(export: Export, prop: Prop) -> str:
    """Name of an object's file: ``hands-apple.usd`` beside ``hands.usd``."""
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
    """Write exports and films in one pass over the frames."""
    from warpjld.io.caches import open_cache

    def cache_of(name: str, surface: Surface, label: str) -> Writer[Cache]:
        place = out.place(name)
        timing: dict[str, Any] = {"frames": len(frames), "rate": scene.rate, "start_frame": int(frames[0])}
        return Writer(name, place, lambda: open_cache(place, surface, name=label.lower(), **timing), failures)

    def studio_of(film: FilmOutput) -> Writer[Studio]:
        place = out.place(film.name)
        begin = page_studio if film.name.lower().endswith(PAGE) else film_studio
        return Writer(film.name, place, lambda: begin(scene, crowd, film, place), failures)

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
                stack.enter_context(cache_of(prop_export_name(export, prop), prop_surface(prop), prop.name))
                for export in exports
                if export.actor is None
            ]
            for prop in crowd.props
        ]
        studios = [stack.enter_context(studio_of(film)) for film in films]
        writers: list[Writer[Any]] = [*studios]
        writers += [writer for group in (*caches, *prop_caches) for writer in group]
        for start, count, parts in _blocks(crowd, len(frames), threads):
            if not any(writer.works for writer in writers):
                return
            worn = [crowd.worn(role, v, start) for role, v in zip(crowd.roles, parts, strict=True)]
            for actor_caches, vertices in zip(caches, worn, strict=True):
                for cache in actor_caches:
                    cache.do(partial(_write, vertices=vertices))
            for prop, places, object_caches in zip(crowd.props, crowd.places, prop_caches, strict=True):
                if object_caches:
                    moved = np.stack([crowd.prop_vertices(prop, places, start + k) for k in range(count)])
                for cache in object_caches:
                    cache.do(partial(_write, vertices=moved.astype(np.float32)))
            for k in range(count):
                progress("frames", start + k, len(frames))
                if studios:
                    together = np.concatenate([np.empty((0, 3), np.float32), *(vertices[k] for vertices in worn)])
                for studio in studios:
                    studio.do(partial(_take, frame=start + k, vertices=together))


def _blocks(
    crowd: Crowd, count: int, threads: int | None
) -> Iterator[tuple[int, int, tuple[NDArray[np.float32], ...]]]:
    """Blocks of frames: index of the first, their number, and the vertices of every actor; also without actors."""
    from warpjld.covering.blocks import FEW_FRAMES, frames_at_once

    surfaces = [len(role.covering.surface.vertices) for role in crowd.roles]
    many = frames_at_once(sum(surfaces) + sum(len(prop.thing.vertices) for prop in crowd.props))
    if any(role.contact is not None for role in crowd.roles):
        many = FEW_FRAMES
    deformed = [
        role.covering.blocks(role.poses, frames=many, device=crowd.device, threads=threads) for role in crowd.roles
    ]
    for start in range(0, count, many):
        yield start, min(many, count - start), tuple(next(blocks)[1] for blocks in deformed)


def _write(cache: Cache, vertices: NDArray[np.float32]) -> None:
    cache.write(vertices)


def _take(studio: Studio, frame: int, vertices: NDArray[np.float32]) -> None:
    studio.take(frame, vertices)


def _make_pictures(
    scene: Scene,
    crowd: Crowd,
    outputs: Sequence[Output],
    out: OutputFolder,
    progress: Report,
    title: str,
    failures: Failures,
) -> None:
    """Draw pictures and contact sheets."""
    wanted = [output for output in outputs if isinstance(output, Picture | ContactSheet)]
    for number, output in enumerate(wanted):
        progress("pictures", number, len(wanted))
        path = out.place(output.name)
        with failures.kept(output.name, path):
            if isinstance(output, Picture):
                draw_picture(scene, crowd, output, path)
            else:
                draw_contact_sheet(scene, crowd, output, path, title)
