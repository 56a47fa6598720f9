"""A scene and its macros at one moment, to come back to: what undoing a line, or editing one, starts from."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

from warpjld.script.interpreter import Interpreter
from warpjld.script.scene import Scene
from warpjld.script.statements import MacroDefinition

__all__ = ["Moment", "moment_of"]


@dataclass(frozen=True, eq=False)
class Moment:
    """A scene and its macros as they were; nothing that happens later changes it."""

    scene: Scene
    macros: dict[str, MacroDefinition]

    def resume(self) -> Interpreter:
        """An interpreter that goes on from here, on this very scene: resume a ``copy`` to come back more than once."""
        interpreter = Interpreter(self.scene)
        interpreter.macros = dict(self.macros)
        return interpreter

    def copy(self) -> Moment:
        """The same moment with a scene of its own."""
        return Moment(_copied(self.scene), dict(self.macros))


def moment_of(interpreter: Interpreter) -> Moment:
    """The scene of an interpreter as it is now: rigs, bound surfaces and objects, which nothing changes, are not
    copied."""
    return Moment(_copied(interpreter.scene), dict(interpreter.macros))


def _copied(scene: Scene) -> Scene:
    fixed: list[object] = [scene.say, scene.warn]
    for actor in scene.actors.values():
        fixed += [actor.rig, actor.skeleton, actor.parameters, actor.covering, actor.recorded]
    for prop in scene.props.values():
        fixed += [prop.thing, prop.shapes]
    return deepcopy(scene, {id(one): one for one in fixed})
