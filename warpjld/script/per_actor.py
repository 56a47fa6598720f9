"""Outputs of which every actor has a file of its own: which actors, and what each file is called."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from warpjld.script.outputs import Export, MotionFile

if TYPE_CHECKING:
    from warpjld.script.scene import Actor, Scene

__all__ = ["actors_of", "file_of"]


def actors_of(output: Export | MotionFile, scene: Scene) -> list[Actor]:
    """The actors that a line asks for."""
    return [actor for actor in scene.actors.values() if output.actor in (None, actor.name)]


def file_of(output: Export | MotionFile, actor: Actor, scene: Scene) -> str:
    """``hands.usd``; for one of several actors ``hands-left.usd``: each has joints and a vertex order of its own."""
    if output.actor is not None or len(scene.actors) == 1:
        return output.name
    path = PurePosixPath(output.name)
    return str(path.with_name(f"{path.stem}-{actor.name.lower()}{path.suffix}"))
