"""Visible surfaces of solved frames, and their view for notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.display.surfaces import DeformedSurfaces
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.simulation.solve.start_frame import StartFrame

if TYPE_CHECKING:
    from warpjld.page.view import SurfaceView, ViewedSurface
    from warpjld.render import ColorScale

__all__ = ["surfaces_of_frames", "view_of_frames"]

_OBJECT = "#8fa3b8"


def surfaces_of_frames(model: ContactModel, frames: Sequence[SolvedFrame], before: StartFrame) -> DeformedSurfaces:
    """Visible surfaces of solved frames.

    Args:
        model: Contact model that the frames were solved with, or an edited version of it.
        frames: Solved frames.
        before: Start frame, with the objects moved before the first frame.
    """
    animation = model.animation
    assert animation is not None
    return DeformedSurfaces(
        model,
        frames,
        lambda actor, frame: animation.actors[actor].skin(frame),
        {name: (np.array(moments), places) for name, (moments, places) in before.moved.items()},
        {name: animation.objects[name].thing.vertices for name in before.moved},
    )


def view_of_frames(surfaces: DeformedSurfaces) -> SurfaceView:
    """View of contact pressure on all deformable bodies, with the rigid objects, by frame."""
    from warpjld.page.view import SurfaceView
    from warpjld.render import ColorScale

    scale = ColorScale.of_pressure(surfaces.high)
    numbers = [surfaces.model.start, *(solved.frame for solved in surfaces.frames)] if surfaces.frames else []
    return SurfaceView([_seen(surfaces, frame, scale) for frame in numbers], numbers=numbers)


def _seen(surfaces: DeformedSurfaces, frame: float, scale: ColorScale) -> list[ViewedSurface]:
    from warpjld.page.view import ViewedSurface

    model, animation = surfaces.model, surfaces.model.animation
    assert animation is not None
    out, apart = [], surfaces.separated(frame)
    for body in model.bodies:
        refined = surfaces.refined(body.name, body.triangles, len(body.surface))
        points, pressure = refined.of(apart.vertices[body.name]), surfaces.pressure(body.name, frame)
        colors = scale.colors(np.zeros(len(points)) if pressure is None else pressure)
        out.append(ViewedSurface(body.name, points, refined.faces, colors=colors))
    for name in model.obstacles:
        if name in animation.objects:
            thing = animation.objects[name].thing
            moved = animation.objects[name].place(frame).apply(thing.vertices)[0]
            out.append(ViewedSurface(name, moved, thing.faces, _OBJECT))
    return out
