"""Pictures, contact sheets and films of a scene's actors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld import render
from warpjld.errors import InputError
from warpjld.script.crowd import Crowd, role_of
from warpjld.script.directing import shot_at
from warpjld.script.folder import OutputFolder
from warpjld.script.outputs import CameraSetting, ContactSheet, FilmOutput, Picture, PictureStyle
from warpjld.script.pressure import PressureView
from warpjld.script.props import prop_places
from warpjld.script.scene import Scene

__all__ = [
    "FilmStudio",
    "PressureStudio",
    "draw_contact_sheet",
    "draw_picture",
    "film_studio",
    "preview",
    "sheet_frames",
]

_CELL = (5 / 12, 19 / 36)  # width and height of a contact sheet's cell, relative to the height of a picture
_CELLS = 6  # cells on a contact sheet whose frames are not listed


class FilmView:
    """Cameras and lamps of a film, frame by frame."""

    def __init__(self, scene: Scene, crowd: Crowd, asked: FilmOutput, stage: render.SceneRenderer) -> None:
        self._scene, self._crowd, self._asked, self._stage = scene, crowd, asked, stage
        self._size = framed_size(scene, asked.style)
        self._views: dict[CameraSetting, render.Camera] = {}

    def at(self, place: int) -> CameraSetting | None:
        """Set the renderer's camera and lamps for the ``place``-th frame; the camera, or None outside all shots."""
        frame = float(self._crowd.frames[place])
        camera = self._asked.camera
        if self._asked.shots:
            shot = shot_at(self._asked.shots, frame)
            if shot is None:
                return None
            camera = shot.camera
        if camera.keys or self._asked.shots:
            self._stage.look(self._view(camera, frame))
        if self._scene.lamps:
            self._stage.light(lamps_at(self._scene, frame))
        return camera

    def _view(self, camera: CameraSetting, frame: float) -> render.Camera:
        if camera.keys:
            return self._crowd.camera(camera, self._size, frame)
        if camera not in self._views:
            self._views[camera] = self._crowd.camera(camera, self._size)
        return self._views[camera]


def lamps_at(scene: Scene, frame: float) -> list[render.Lamp]:
    """The lamps of a scene at a frame."""
    return [lamp.at(frame) for lamp in scene.lamps.values()]


def framed_size(scene: Scene, style: PictureStyle) -> tuple[int, int]:
    """Size that a named view is framed for: the picture's, without what a colour scale covers."""
    return render.ColorScale.room_beside(scene.size) if style == "pressure" else scene.size


def style_of(scene: Scene) -> render.Style:
    """Rendering style of a scene."""
    style = render.Style() if scene.backdrop is None else render.Style(background=scene.backdrop)
    return replace(style, picture=scene.backdrop_picture)


class FilmStudio:
    """Renders the frames of a film."""

    def __init__(
        self, scene: Scene, crowd: Crowd, asked: FilmOutput, stage: render.SceneRenderer, film: render.Film
    ) -> None:
        self._crowd, self._view = crowd, FilmView(scene, crowd, asked, stage)
        self._stage, self._film = stage, film

    def take(self, frame: int, vertices: NDArray[np.float32]) -> None:
        """Render the ``frame``-th of the frames, with the concatenated vertices of all actors [m], shape (V, 3)."""
        camera = self._view.at(frame)
        if camera is None:
            return
        shift = self._crowd.shift(camera, frame)
        solids = self._crowd.moved_solids(frame, shift)
        self._film.append(self._stage.draw(vertices - shift, joints=self._crowd.joints(frame) - shift, solids=solids))


class PressureStudio:
    """Renders the frames of a film coloured by contact pressure."""

    def __init__(
        self, scene: Scene, view: PressureView, asked: FilmOutput, stage: render.SceneRenderer, film: render.Film
    ) -> None:
        self._view, self._shown = view, FilmView(scene, view.crowd, asked, stage)
        self._stage, self._film = stage, film

    def take(self, frame: int, vertices: NDArray[np.float32]) -> None:
        """As `FilmStudio.take`."""
        camera = self._shown.at(frame)
        if camera is None:
            return
        shift = self._view.crowd.shift(camera, frame)
        points, values = self._view.at(frame, vertices)
        self._film.append(
            self._stage.draw(points - shift, values=values, solids=[v - shift for v in self._view.others(frame)])
        )


@contextmanager
def film_studio(scene: Scene, crowd: Crowd, film: FilmOutput, path: Path) -> Iterator[FilmStudio | PressureStudio]:
    """Context that renders a ``FILM``."""
    camera = crowd.camera(film.camera, framed_size(scene, film.style))
    quality = render.Quality.film()
    with render.Film(path, rate=scene.rate) as writer:
        if film.style == "pressure":
            view = PressureView(crowd, film.only, film.digits)
            with view.stage(camera, scene.size, quality, 0) as stage_:
                yield PressureStudio(scene, view, film, stage_, writer)
            return
        with render.SceneRenderer(
            crowd.faces,
            camera,
            look=film.style,
            size=scene.size,
            segments=_bones(crowd, film.style),
            solids=crowd.solids(),
            colors=crowd.colors,
            texture=crowd.texture,
            lamps=lamps_at(scene, float(crowd.frames[0])),
            style=style_of(scene),
            quality=quality,
        ) as stage_:
            yield FilmStudio(scene, crowd, film, stage_, writer)


def draw_picture(scene: Scene, crowd: Crowd, picture: Picture, path: Path) -> None:
    """Draw a ``PICTURE``; a named view is framed for the whole sequence, so that pictures of a scene match, those of
    pressure beside their colour scale."""
    now = crowd.at(picture.frame, scene.rate)
    shift = now.shift(picture.camera, 0)
    camera = crowd.camera(picture.camera, framed_size(scene, picture.style), picture.frame)
    if picture.style == "pressure":
        solved = [] if crowd.pressed is None else [frame.frame for frame in crowd.pressed.frames]
        if crowd.pressed is not None and picture.frame > max(solved, default=crowd.pressed.model.start):
            reached = f"only up to frame {max(solved):g}" if solved else "at no frame"
            raise InputError(f"contact was solved {reached}: there is no pressure at frame {picture.frame:g}")
        view = PressureView(now, picture.only, picture.digits)
        points, values = view.at(0, now.surface(0))
        with view.stage(camera, scene.size, render.Quality(), shift) as stage_:
            render.save_picture(path, stage_.draw(points - shift, values=values))
        return
    with render.SceneRenderer(
        crowd.faces,
        camera,
        look=picture.style,
        size=scene.size,
        segments=_bones(crowd, picture.style),
        solids=now.solids(shift),
        colors=now.colors,
        texture=now.texture,
        lamps=lamps_at(scene, picture.frame),
        style=style_of(scene),
    ) as stage_:
        drawn = stage_.draw(now.surface(0) - shift, joints=now.joints(0) - shift)
        if picture.numbers:
            drawn = render.with_numbers(drawn, stage_, _numbered(now, picture.only, shift))
        render.save_picture(path, drawn)


def _numbered(now: Crowd, only: str | None, shift: NDArray[np.float64]) -> list[render.Numbered]:
    """Actors and objects whose vertex and facet numbers are drawn."""
    found, points, start = [], now.surface(0) - shift, 0
    for role in now.roles:
        surface = role.covering.surface
        if only in (None, role.actor.name):
            own = points[start : start + len(surface.vertices)]
            found.append(render.Numbered(own, surface.faces, surface.numbers, surface.facets))
        start += len(surface.vertices)
    for prop, own in zip(now.props, now.solid_vertices(0, shift), strict=True):
        if only in (None, prop.name):
            thing = prop.thing
            numbers = np.arange(len(own)) if thing.numbers is None else thing.numbers
            facets = np.arange(len(thing.faces)) if thing.facets is None else thing.facets
            found.append(render.Numbered(own, thing.faces, numbers, facets))
    return found


def draw_contact_sheet(scene: Scene, crowd: Crowd, sheet: ContactSheet, path: Path, title: str) -> None:
    """Draw a ``CONTACT`` sheet (as A Figs 14 and 15)."""
    frames = sheet.frames or sheet_frames(scene, crowd.frames)
    cell = max(16, round(_CELL[0] * scene.size[1])), max(16, round(_CELL[1] * scene.size[1]))
    moments = [crowd.at(frame, scene.rate) for frame in frames]
    picture = render.contact_sheet(
        np.stack([m.surface(0) - m.shift(sheet.camera, 0) for m in moments]),
        crowd.faces,
        crowd.camera(sheet.camera, cell),
        joints=np.stack([m.joints(0) - m.shift(sheet.camera, 0) for m in moments]),
        segments=crowd.segments,
        solids=moments[0].solids(moments[0].shift(sheet.camera, 0)),
        moved=[m.solid_vertices(0, m.shift(sheet.camera, 0)) for m in moments],
        numbers=[round(frame, 3) if frame % 1 else int(frame) for frame in frames],  # type: ignore[misc]
        size=cell,
        title=title,
    )
    render.save_picture(path, picture)


def sheet_frames(scene: Scene, frames: NDArray[np.float64]) -> tuple[float, ...]:
    """Frames for a contact sheet: the key frames, or evenly spaced ones where there are too many or too few keys."""
    keys = {key for actor in scene.actors.values() for key in actor.key_frames if frames[0] <= key <= frames[-1]}
    if 3 <= len(keys) <= _CELLS:
        return tuple(sorted(keys))
    chosen = np.linspace(0, len(frames) - 1, min(_CELLS, len(frames))).round().astype(int)
    return tuple(float(frame) for frame in frames[np.unique(chosen)])


def preview(scene: Scene, frame: float, style: PictureStyle) -> Path:
    """Draw a picture of any frame of the present scene into the output folder (R5); its path."""
    roles = [role_of(a, np.array([frame]), scene.rate) for a in scene.actors.values()]
    crowd = Crowd(
        roles,
        np.array([frame]),
        props=list(scene.props.values()),
        whereabouts=partial(prop_places, scene.actors, scene.rate),
    )
    name = f"{style}-{frame:g}.png"
    with OutputFolder(scene.folder) as out:
        draw_picture(scene, crowd, Picture(name, frame, style, scene.camera), out.place(name))
    return scene.folder / name


def _bones(crowd: Crowd, style: PictureStyle) -> NDArray[np.int32] | None:
    return crowd.segments if style == "wireframe" else None
