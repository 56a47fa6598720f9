"""Outputs with one file per actor: their actors and file names."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from warpjld.script.outputs import Export, MotionFile

if TYPE_CHECKING:
    from warpjld.script.scene import Actor, Scene

__all__ = ["actors_of", "file_of"]


def actors_of(output: Export | MotionFile, scene: Scene) -> list[Actor]:
    """The actors that an output includes."""
    return [actor for actor in scene.actors.values() if output.actor in (None, actor.name)]


def file_of(output: Export | MotionFile, actor: Actor, scene: Scene) -> str:
    """Name of an actor's file: ``hands.usd``, or ``hands-left.usd`` where the output includes several actors."""
    if output.actor is not None or len(scene.actors) == 1:
        return output.name
    path = PurePosixPath(output.name)
    return str(path.with_name(f"{path.stem}-{actor.name.lower()}{path.suffix}"))
