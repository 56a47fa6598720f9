"""Contact simulation of a scene: its specification and animation in, keys of digits and output files back."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.script.binding import cover
from warpjld.script.folder import OutputFolder
from warpjld.script.outputs import FilmOutput, Grips, Output, Picture, Table, TactileOutput, Volume
from warpjld.script.props import prop_places
from warpjld.script.scene import SplineConstants
from warpjld.script.staging import stage
from warpjld.simulation.specification import located
from warpjld.skeleton import CHANNELS, poses_from_angles

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.fem.contact import Obstacle
    from warpjld.grasp import GraspObject, Places
    from warpjld.rig import Rig
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene
    from warpjld.simulation.animation import AngleEdit
    from warpjld.simulation.display.surfaces import DeformedSurfaces
    from warpjld.simulation.simulate import Keep, Simulation
    from warpjld.skeleton import Poses, Skeleton

__all__ = ["REST", "SceneAnimation", "check_contact", "run_contact", "write_contact", "write_keys"]

REST = SplineConstants(tension=1.0)
"""Spline constants of a key with zero slope, so that later keys do not change the curve before it."""

_THROUGH = SplineConstants()  # of a key that the curve passes smoothly


def run_contact(
    scene: Scene,
    folder: Path,
    progress: Callable[[str, int, int], None] = lambda what, done, total: None,
    keeping: Callable[[Keep], None] = lambda keep: None,
    showing: Callable[[DeformedSurfaces], None] = lambda surfaces: None,
) -> Simulation:
    """Run the simulation that ``PRESS`` specifies; grips found and angles corrected become keys of the actors.

    Args:
        scene: The scene.
        folder: Output folder, for the state file.
        progress: Called with a stage's name, steps done and total.
        keeping: Called with a function that saves the state, see ``simulate``.

    Raises:
        InputError: Bodies that cannot be meshed or driven; names the command's line.
    """
    from warpjld.simulation.simulate import simulate

    pressing = scene.contact.pressing
    assert pressing is not None
    try:
        grasps = [attempt.object for attempt in scene.attempts if attempt.command.startswith("GRASP ")]
        asked = replace(
            scene.contact, grasped=tuple(dict.fromkeys(grasps)), pressing=replace(pressing, rate=scene.rate)
        )
        found = simulate(
            asked, SceneAnimation(scene), folder=folder, keeping=keeping, showing=showing, progress=progress
        )
    except InputError as error:
        raise located(error, pressing.where) from error
    for edit in found.solved.edits:
        write_keys(scene.actor(edit.actor), edit)
    return found


@dataclass(frozen=True, eq=False)
class _StagedActor:
    """An actor of the scene as ``ActorAnimation`` of the simulation."""

    actor: Actor
    rate: float

    @property
    def name(self) -> str:
        return self.actor.name

    @property
    def skeleton(self) -> Skeleton:
        return self.actor.skeleton

    @property
    def rig(self) -> Rig:
        return replace(self.actor.rig, skeleton=self.actor.skeleton)

    @property
    def covering(self) -> Covering:
        return cover(self.actor)

    @property
    def bendable(self) -> bool:
        return self.actor.recorded is None

    def pose(self, frame: float) -> Poses:
        return stage(self.actor, np.array([frame]), self.rate)

    def angles(self, frame: float) -> NDArray[np.float64]:
        return self.actor.motion.sample([frame], self.actor.skeleton)[0][0]

    def posed(self, angles: NDArray[np.float64], frame: float) -> Poses:
        moment = np.array([frame])
        root = self.actor.motion.sample(moment, self.actor.skeleton)[1]
        poses = poses_from_angles(self.actor.skeleton, angles[None], root_position=root)
        return self.actor.placement.apply(poses, moment)

    def skin(self, frame: float) -> NDArray[np.float64]:
        return self.covering.deform(self.pose(frame))[0].astype(np.float64)

    def edited(self, edits: Sequence[AngleEdit]) -> _StagedActor:
        actor = replace(self.actor, motion=copy.deepcopy(self.actor.motion))
        for edit in edits:
            write_keys(actor, edit)
        return replace(self, actor=actor)


@dataclass(frozen=True, eq=False)
class _StagedObject:
    """An object of the scene as ``ObjectAnimation`` of the simulation."""

    prop: Prop
    actors: Mapping[str, Actor]
    rate: float

    @property
    def name(self) -> str:
        return self.prop.name

    @property
    def thing(self) -> GraspObject:
        return self.prop.thing

    @property
    def follows(self) -> set[str]:
        return {association.actor for association in self.prop.associations}

    def place(self, frame: float) -> Places:
        return prop_places(self.actors, self.rate, self.prop, np.array([frame]))

    def obstacle(self, start: float) -> Obstacle:
        from warpjld.fem.contact.obstacles.meshes import Keyframed
        from warpjld.simulation.bodies.obstacle import placed_motion, rigid_obstacle

        prop, motion = self.prop, placed_motion(self.place, start)
        if prop.shapes is not None:
            return Keyframed(prop.thing.faces, prop.shapes.frames - start, prop.shapes.vertices, motion)
        return rigid_obstacle(prop.thing, motion) if prop.barred is None else prop.barr(start, motion)


class SceneAnimation:
    """A scene as ``Animation`` of the simulation."""

    def __init__(self, scene: Scene, edited: Mapping[str, _StagedActor] | None = None) -> None:
        self._scene = scene
        self.actors = {name: _StagedActor(actor, scene.rate) for name, actor in scene.actors.items()}
        self.actors |= edited or {}

    @cached_property
    def objects(self) -> dict[str, _StagedObject]:
        """Objects by name, in the order they were added."""
        actors = {name: staged.actor for name, staged in self.actors.items()}
        return {name: _StagedObject(prop, actors, self._scene.rate) for name, prop in self._scene.props.items()}

    def edited(self, edits: Sequence[AngleEdit]) -> SceneAnimation:
        """Copy with edits applied to copies of the actors; objects attached to none of these are shared."""
        by_actor = {edit.actor: [other for other in edits if other.actor == edit.actor] for edit in edits}
        actors = {name: self.actors[name].edited(own) for name, own in by_actor.items()}
        out = SceneAnimation(self._scene, self.actors | actors)
        for name, staged in self.objects.items():
            if not staged.follows & set(actors):
                out.objects[name] = staged
        return out


def write_keys(actor: Actor, edit: AngleEdit) -> None:
    """Set the keys of an edit; the curve before it is preserved by a key at every frame."""
    channel = f"{actor.skeleton.names[edit.joint]}.{CHANNELS[edit.channel]}"
    track = actor.motion.tracks.get(channel)
    if edit.frame is None:
        later = [] if track is None else [key for key in track.keys if key.frame > edit.kept]
        for key in later:  # a digit that stopped may not have reached the angle that later keys hold
            if track is not None and key.value == later[0].value:
                track.set(replace(key, value=edit.value))
        return
    first = edit.kept if track is None else track.frames[0]  # a joint without keys keeps its angle until then
    before = np.unique([*np.arange(np.ceil(first), edit.kept + 1e-9), edit.kept])
    kept = [actor.value(channel, frame) for frame in before.tolist()]
    for frame, value in zip(before.tolist(), kept, strict=True):
        actor.set_keys(channel, [frame], value, _THROUGH)
    actor.set_keys(channel, [edit.frame], edit.value, _THROUGH)


def check_contact(scene: Scene, outputs: Sequence[Output], frames: NDArray[np.float64]) -> list[str]:
    """Check that contact is solved for every output that shows it.

    Args:
        scene: The scene.
        outputs: Files to make.
        frames: Frames to make, shape (F,).

    Returns:
        Notes for the user.

    Raises:
        InputError: An output needs ``PRESS``, or a frame that ``PRESS`` does not solve, or flesh that no actor has.
    """
    pressing = scene.contact.pressing
    span = "" if pressing is None else f"PRESS solves frames {pressing.first} to {pressing.last}"
    for output in outputs:
        problem = ""
        colored = isinstance(output, FilmOutput | Picture) and output.style == "pressure"
        if pressing is None:
            if colored or isinstance(output, Table | TactileOutput | Volume):
                problem = "shows contact, but none is solved: PRESS <first> <last> asks for it"
        elif isinstance(output, Picture) and colored and not pressing.first <= output.frame <= pressing.last:
            problem = f"shows pressure at frame {output.frame:g}, but {span}"
        elif isinstance(output, TactileOutput) and (output.actor or "") not in ("", *scene.contact.flesh):
            problem = f"shows what {output.actor} feels, but it has no flesh: FLESH {output.actor} makes it so"
        elif isinstance(output, TactileOutput) and not scene.contact.flesh:
            problem = "shows what skin feels, but no actor has flesh: FLESH <actor> makes it so"
        if problem:
            raise located(InputError(f"'{output.name}' {problem}"), scene.asked.get(output.name))
    if pressing is None:
        return []
    first, last = float(frames[0]), float(frames[-1])
    if pressing.last < first or pressing.first > last:
        raise located(InputError(f"{span}, but {first:g} to {last:g} are made: see FRAMES"), pressing.where)
    return [f"{span}, of which those after {last:g} are not made: see FRAMES"] if pressing.last > last else []


def write_contact(found: Simulation, outputs: Sequence[Output], out: OutputFolder) -> None:
    """Write tables, grips, tactile signals and volumes of a simulation into the output folder."""
    from warpjld.simulation.grip.found import write_grips
    from warpjld.simulation.report.table import write_table
    from warpjld.simulation.report.volume_series import write_volumes

    for output in outputs:
        if isinstance(output, Table):
            write_table(out.place(output.name), found.rows)
        elif isinstance(output, Grips):
            write_grips(out.place(output.name), found.grips)
        elif isinstance(output, TactileOutput):
            _write_touch(found, output, out.place(output.name))
        elif isinstance(output, Volume):
            write_volumes(out.place(output.name), found.model, found.solved.frames)


def _write_touch(found: Simulation, output: TactileOutput, path: Path) -> None:
    from warpjld.simulation.report.tactile_files import draw_tactile, write_tactile

    actor = output.actor or next((hand.name for hand in found.model.hands), "nobody")
    felt = found.tactile(actor)
    if path.suffix == ".png":
        draw_tactile(path, felt, f"What the skin of {actor} feels", "frame")
    else:
        write_tactile(path, felt)
