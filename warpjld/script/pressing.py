"""Contact of a scene: bodies as the script has them at the first moment, solved over its frames, and reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.press.wishes import FleshWish, Pressing, placed
from warpjld.script.binding import cover
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.fem.contact import Obstacle
    from warpjld.fem.hand.muscles import Effort
    from warpjld.grasp import Places
    from warpjld.press.bodies import Bodies, HandBody, ObjectBody
    from warpjld.press.frames import SolvedFrame
    from warpjld.press.pressed import Pressed
    from warpjld.press.table import Row
    from warpjld.press.verdict import Verdict
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = ["PressReport", "first_moment", "prop_obstacle", "run_press"]

Report = Callable[[str, int, int], None]

_CLEAR = 2e-4
"""Skin deeper inside an object than this touches it [m]."""

_ROUNDED = 1e-3
"""Radius of the edges of boxes and cylinders as contact feels them [m]: skin has no corner to lie around."""


@dataclass(eq=False)
class PressReport:
    """What came of ``PRESS``.

    Attributes:
        pressed: Shapes and pressures.
        rows: The table.
        verdict: In words.
        notes: What was found on the way.
    """

    pressed: Pressed
    rows: list[Row]
    verdict: Verdict
    notes: list[str] = field(default_factory=list)


def run_press(scene: Scene, folder: Path, progress: Report = lambda what, done, total: None) -> PressReport:
    """Do what ``PRESS`` asks for.

    Raises:
        InputError: Bodies that cannot be meshed or driven; names the command's line.
    """
    pressing = scene.contact.pressing
    assert pressing is not None
    try:
        return _run(scene, pressing, folder, progress)
    except InputError as error:
        raise placed(error, pressing.where) from error


def _run(scene: Scene, pressing: Pressing, folder: Path, progress: Report) -> PressReport:
    from warpjld.press.bodies import assemble
    from warpjld.press.checks import refuse_hopeless
    from warpjld.press.pressed import Pressed
    from warpjld.press.run import solve_frames
    from warpjld.press.verdict import verdict_of

    progress("looking for the first touch", 0, 1)
    start = first_moment(scene, pressing)
    notes: list[str] = []
    progress("meshing", 0, 1)
    hands = [_hand(scene, scene.actor(name), wish, start, notes) for name, wish in scene.contact.flesh.items()]
    objects = [_object(scene, scene.prop(name), start) for name in scene.contact.physical]
    rigid = [prop for prop in scene.props.values() if prop.name not in scene.contact.physical]
    obstacles = {prop.name: prop_obstacle(scene, prop, start) for prop in rigid}
    bodies = assemble(hands, objects, obstacles, scene.contact)
    refuse_hopeless(bodies, scene.contact)
    frames = [f for f in range(pressing.first, pressing.last + 1, pressing.every) if f > start]
    if frames[-1:] != [pressing.last]:
        frames.append(pressing.last)
    table = _Table(scene, bodies)
    solved = solve_frames(
        bodies,
        start,
        frames,
        watch=table.take if pressing.stop else table.note,
        state=None if pressing.state is None else folder / pressing.state,
        progress=progress,
    )
    if solved.resumed:
        notes.append(f"{solved.resumed} of {len(solved.frames)} frames were in {pressing.state} already")
    verdict = verdict_of(solved, table.rows, table.suggestions())
    return PressReport(Pressed(bodies, solved), table.rows, verdict, notes)


def first_moment(scene: Scene, pressing: Pressing) -> float:
    """The last frame from which on contact has to be solved: the one before skin or an object first touches something;
    the first one where something touches there already (R91, R112)."""
    physical = [scene.prop(name) for name in scene.contact.physical]
    if scene.contact.prescribed or any(scene.contact.gravity):
        return float(pressing.first)
    for frame in range(pressing.first, pressing.last + 1):
        if _touches(scene, float(frame), physical):
            return float(max(pressing.first, frame - 1))
    return float(pressing.last - 1)


def _touches(scene: Scene, frame: float, physical: list[Prop]) -> bool:
    moment = np.array([frame])
    solids = {prop.name: prop_obstacle(scene, prop, frame) for prop in scene.props.values()}
    for name in scene.contact.flesh:
        actor = scene.actor(name)
        skin = cover(actor).deform(stage(actor, moment, scene.rate))[0].astype(np.float64)
        if any(_inside(solid, skin, _CLEAR) for solid in solids.values()):
            return True
    for prop in physical:
        vertices = scene.whereabouts(prop, moment).apply(prop.thing.vertices)[0]
        others = [other for other in scene.props.values() if other is not prop and (_driven(prop) or _driven(other))]
        if any(_inside(solids[other.name], vertices, -_CLEAR) for other in others):
            return True
    return False


def _driven(prop: Prop) -> bool:
    """Whether the script moves or deforms an object; what only lies on something waits for a hand."""
    return bool(prop.placement.tracks or prop.associations or prop.deforms)


def _inside(solid: Obstacle, points: NDArray[np.float64], depth: float) -> bool:
    return bool((solid.project(points, 0.0).distance < -depth).any())


def _hand(scene: Scene, actor: Actor, wish: FleshWish, start: float, notes: list[str]) -> HandBody:
    from warpjld.fem.hand.blend import Moves
    from warpjld.fem.hand.flesh_hand import build_flesh_hand
    from warpjld.fem.hand.laws import hand_laws
    from warpjld.press.bodies import HandBody
    from warpjld.press.rest import part_of, posed

    poses = stage(actor, np.array([start]), scene.rate)
    skin = cover(actor).deform(poses)[0].astype(np.float64)
    rig = replace(actor.rig, skeleton=actor.skeleton)
    built = build_flesh_hand(rig, wish.element, name=actor.name.lower())
    hand, gap = posed(built, poses, skin)
    if gap > 0.5 * wish.element:
        notes.append(f"{actor.name}: the volume stays up to {1e3 * gap:.1f} mm off the skin where it folds")
    part = part_of(hand, poses, skin, wish.digits)
    laws = hand_laws(
        part.hand.mesh.region_names,
        flesh=wish.flesh,
        skin=wish.skin,
        poisson=wish.poisson,
        stiffening=wish.stiffening,
    )

    @lru_cache(maxsize=8)
    def moves(time: float) -> Moves:
        return part.hand.moves(stage(actor, np.array([start + time]), scene.rate))

    return HandBody(actor.name, part, laws, moves, wish.skin, wish.itself)


def _object(scene: Scene, prop: Prop, start: float) -> ObjectBody:
    from warpjld.press.bodies import ObjectBody
    from warpjld.press.volumes import object_volume

    physical = scene.contact.physical[prop.name]
    at = _places(scene, prop, start)
    try:
        volume = object_volume(prop.name, prop.thing, physical, at(0.0))
        states = []
        stage_at_first = prop.thing.place.apply(volume.local)[0]
        for (name, points), state in scene.contact.prescribed.items():
            if name == prop.name:
                try:
                    states.append((state, state.points.choose(volume.local, stage_at_first)))
                except InputError as error:
                    raise InputError(f"points {points}: {error.message}") from None
    except InputError as error:
        raise placed(InputError(f"{prop.name}: {error.message}"), physical.where) from error
    return ObjectBody(volume, at, states, start)


def prop_obstacle(scene: Scene, prop: Prop, start: float) -> Obstacle:
    """An object as an obstacle; its time is in frames from ``start``. Built-in shapes are exact, with edges rounded."""
    from warpjld.fem.contact.meshes import Keyframed, RigidMesh
    from warpjld.fem.contact.solids import Box, Cylinder, Sphere

    places = _places(scene, prop, start)

    def motion(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        here = places(time)
        return here.position[0], here.rotation[0]

    thing = prop.thing
    if prop.shapes is not None:
        return Keyframed(thing.faces, prop.shapes.frames - start, prop.shapes.vertices, motion)
    if prop.barred is not None:
        return prop.barr(start, motion)
    middle = 0.5 * (thing.vertices.min(axis=0) + thing.vertices.max(axis=0))
    edge = min(_ROUNDED, 0.2 * float(thing.size.min()))
    if thing.origin == "ball":
        return Sphere(middle, 0.5 * float(thing.size.max()), motion)
    if thing.origin == "box":
        return Box(thing.size, middle, edge, motion)
    if thing.origin == "cylinder":
        return Cylinder(0.5 * float(thing.size[0]), float(thing.size[1]), middle, edge=edge, motion=motion)
    return RigidMesh(thing.vertices, thing.faces, motion)


def _places(scene: Scene, prop: Prop, start: float) -> Callable[[float], Places]:
    @lru_cache(maxsize=8)
    def at(time: float) -> Places:
        return scene.whereabouts(prop, np.array([start + time]))

    return at


class _Table:
    """Rows as frames are solved, and what the muscles say."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        self._scene, self._bodies = scene, bodies
        self.rows: list[Row] = []
        self._efforts: list[tuple[str, float, Effort]] = []

    def note(self, solved: SolvedFrame) -> str | None:
        """Add rows; never stops."""
        self.take(solved)
        return None

    def take(self, solved: SolvedFrame) -> str | None:
        """Add rows; a text where muscles can do no more (R118)."""
        from warpjld.fem.hand.bone_loads import loads_from_contact
        from warpjld.fem.hand.muscles import effort_of
        from warpjld.press.table import rows_of

        reason = None
        for hand in self._bodies.hands:
            span = self._bodies.spans[hand.name]
            actor = self._scene.actor(hand.name)
            flesh = hand.part.hand
            # what contact puts on the bones: bent joints strain their own flesh, which is not the muscles' concern
            loads = loads_from_contact(flesh, solved.displacement[span], solved.nodal.sum(axis=0)[span])
            poses = stage(actor, np.array([solved.frame]), self._scene.rate)
            effort = effort_of(actor.skeleton, poses, loads)
            self._efforts.append((hand.name, solved.frame, effort))
            self.rows += rows_of(self._bodies, hand, solved, effort)
            reason = reason or effort.stop()
        return None if reason is None else f"stopped at frame {solved.frame:g}: {reason}"

    def suggestions(self) -> list[str]:
        """What to open, at the frame that strains an actor most."""
        from warpjld.fem.hand.suggestions import suggestions

        out = []
        for hand in self._bodies.hands:
            mine = [(frame, effort) for name, frame, effort in self._efforts if name == hand.name]
            if not mine:
                continue
            worst = max(range(len(mine)), key=lambda k: mine[k][1].share)
            frame, effort = mine[worst]
            before = mine[worst - 1] if worst else None
            actor = self._scene.actor(hand.name)
            if actor.recorded is not None:
                continue
            moments = np.array([frame, frame if before is None else before[0]])
            angles, _ = actor.motion.sample(moments, actor.skeleton)
            found = suggestions(
                actor.skeleton, effort, angles[0], before and before[1], None if before is None else angles[1]
            )
            out += [f"{hand.name} at frame {frame:g}: {one.text}" for one in found]
        return out
