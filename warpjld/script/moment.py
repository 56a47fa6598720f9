"""Snapshots of a scene and its macros, for undoing and editing lines of a script."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

from warpjld.script.interpreter import Interpreter
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition

__all__ = ["Moment", "moment_of"]


@dataclass(frozen=True, eq=False)
class Moment:
    """Snapshot of a scene and its macros; later commands do not change it."""

    scene: Scene
    macros: dict[str, MacroDefinition]

    def resume(self) -> Interpreter:
        """Interpreter that continues on this snapshot's own scene; ``copy`` first to resume repeatedly."""
        interpreter = Interpreter(self.scene)
        interpreter.macros = dict(self.macros)
        return interpreter

    def copy(self) -> Moment:
        """Copy with a scene of its own."""
        return Moment(_copied(self.scene), dict(self.macros))


def moment_of(interpreter: Interpreter) -> Moment:
    """Snapshot of an interpreter's scene; rigs, coverings and objects, which are immutable, are shared."""
    return Moment(_copied(interpreter.scene), dict(interpreter.macros))


def _copied(scene: Scene) -> Scene:
    fixed: list[object] = [scene.say, scene.warn]
    for actor in scene.actors.values():
        fixed += [actor.rig, actor.skeleton, actor.parameters, actor.covering, actor.recorded]
    for prop in scene.props.values():
        fixed += [prop.thing, prop.shapes]
    return deepcopy(scene, {id(shared): shared for shared in fixed})
