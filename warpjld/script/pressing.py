"""Contact of a scene: bodies as the script has them at the first moment, solved over its frames, and reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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

__all__ = ["Approach", "PressReport", "approach", "prop_obstacle", "run_press"]

Report = Callable[[str, int, int], None]

_CLEAR = 2e-4
"""Skin deeper than this inside an object that cannot get out of the way presses on it [m]."""

_PARTED = 0.01
"""Skin of two digits that is nearer than this at rest belongs to where they part [m]."""

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
    before = approach(scene, pressing)
    start = before.start
    notes: list[str] = []
    progress("meshing", 0, 1)
    hands = [_hand(scene, scene.actor(name), wish, start, notes) for name, wish in scene.contact.flesh.items()]
    objects = [_object(scene, scene.prop(name), start, before.place(name)) for name in scene.contact.physical]
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
        method=pressing.method,
        aitken=pressing.aitken,
        watch=table.take if pressing.stop else table.note,
        state=None if pressing.state is None else folder / pressing.state,
        progress=progress,
    )
    if solved.resumed:
        notes.append(f"{solved.resumed} of {len(solved.frames)} frames were in {pressing.state} already")
    verdict = verdict_of(solved, table.rows, table.suggestions())
    pushed = {name: (np.array(frames), places) for name, (frames, places) in before.moved.items()}
    shapes = {name: scene.prop(name).thing.vertices for name in pushed}

    def covered(actor: str, frame: float) -> NDArray[np.floating]:
        one = scene.actor(actor)
        return np.asarray(cover(one).deform(stage(one, np.array([frame]), scene.rate))[0])

    pressed = Pressed(bodies, solved, covered, pushed, shapes)
    if solved.frames:
        notes += pressed.notes(solved.frames[-1].frame)
    return PressReport(pressed, table.rows, verdict, notes)


@dataclass(frozen=True, eq=False)
class Approach:
    """How a scene comes to the moment from which on contact has to be solved.

    Attributes:
        start: That frame: the one before anything is held; the first one where something is held there already.
        moved: Places of free objects that hands push before they hold them, by name: frames and placements.
    """

    start: float
    moved: dict[str, tuple[list[float], list[Places]]]

    def place(self, name: str) -> Places | None:
        """Where a free object is at the start, if not where the script has it."""
        return self.moved[name][1][-1] if name in self.moved else None


def approach(scene: Scene, pressing: Pressing) -> Approach:
    """Look for the first moment that needs solving (R91, R112).

    Before it nothing touches, or what is touched gives way: a free object that is pushed from one side only goes where
    nothing pushes it any more.
    """
    free = [n for n in scene.contact.physical if not any(o == n for o, _ in scene.contact.prescribed)]
    keyed = any(state.tracks for state in scene.contact.prescribed.values())
    moved: dict[str, tuple[list[float], list[Places]]] = {}
    if keyed or any(scene.contact.gravity):
        return Approach(float(pressing.first), moved)
    for frame in range(pressing.first, pressing.last + 1):
        held, places = _held(scene, float(frame), free, moved)
        if held:
            return Approach(float(max(pressing.first, frame - 1)), moved)
        for name, place in places.items():
            frames, sequence = moved.setdefault(name, ([], []))
            frames.append(float(frame))
            sequence.append(place)
    return Approach(float(pressing.last - 1), moved)


def _held(
    scene: Scene, frame: float, free: list[str], moved: dict[str, tuple[list[float], list[Places]]]
) -> tuple[bool, dict[str, Places]]:
    """Whether anything is held at a frame, and where free objects are that are pushed."""
    from warpjld.fem.contact.facets import Facets
    from warpjld.press.settle import settle

    moment = np.array([frame])
    skins = {
        name: cover(actor).deform(stage(actor, moment, scene.rate))[0].astype(np.float64)
        for name in scene.contact.flesh
        for actor in (scene.actor(name),)
    }
    if any(_meets_itself(scene.actor(name), wish, skins[name]) for name, wish in scene.contact.flesh.items()):
        return True, {}
    obstacles = {p.name: prop_obstacle(scene, p, frame) for p in scene.props.values() if p.name not in free}
    if any(_inside(solid, skin) for solid in obstacles.values() for skin in skins.values()):
        return True, {}
    for name in scene.contact.physical:
        if name not in free:
            shape = obstacles[name].mesh(0.0)[0]
            if any(_inside(solid, shape) for other, solid in obstacles.items() if other != name):
                return True, {}
    places: dict[str, Places] = {}
    for name in free:
        prop = scene.prop(name)
        place = moved[name][1][-1] if name in moved else scene.whereabouts(prop, moment)
        vertices = place.apply(prop.thing.vertices)[0]
        skin = np.concatenate([*skins.values(), np.empty((0, 3))])
        if any(float(solid.project(vertices, 0.0).distance.min()) < _CLEAR for solid in obstacles.values()):
            # friction holds what lies on something: the first push is already a grip
            pushed = Facets(vertices, prop.thing.faces).project(skin).distance.min(initial=1.0) if len(skin) else 1.0
            if pushed < -_CLEAR:
                return True, {}
            continue
        found = settle(vertices, prop.thing.faces, skin, [], 0.0)
        if found.overlap > _CLEAR:
            return True, {}
        if name in moved or np.linalg.norm(found.of(vertices) - vertices, axis=1).max() > 1e-6:
            turn = found.turn * Rotation.from_quat(place.rotation[0])
            places[name] = type(place)(found.of(place.position), turn.as_quat()[None])
    return False, places


def _meets_itself(actor: Actor, wish: FleshWish, skin: NDArray[np.float64]) -> bool:
    """Whether skin of two digits, or of a digit and the palm, has passed through one another where flesh would touch
    (R126); where digits part they lie together at rest."""
    from warpjld.covering.intersections import crossing_faces, surface_parts

    if not wish.itself:
        return False
    covering = cover(actor)
    parts = surface_parts(covering)
    pairs = crossing_faces(skin, covering.surface.faces).contact(parts).pairs
    middle = covering.surface.vertices[covering.surface.faces].mean(axis=1)
    far = np.linalg.norm(middle[pairs[:, 0]] - middle[pairs[:, 1]], axis=1) > _PARTED
    mine = np.array([not wish.digits or name.rpartition(".")[2] in wish.digits for name in parts.names])
    return bool((far & mine[parts.of_face[pairs]].all(axis=1)).any())


def _inside(solid: Obstacle, points: NDArray[np.float64]) -> bool:
    return bool((solid.project(points, 0.0).distance < -_CLEAR).any())


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


def _object(scene: Scene, prop: Prop, start: float, place: Places | None = None) -> ObjectBody:
    from warpjld.press.bodies import ObjectBody
    from warpjld.press.volumes import object_volume

    physical = scene.contact.physical[prop.name]
    at = _places(scene, prop, start)
    try:
        volume = object_volume(prop.name, prop.thing, physical, at(0.0) if place is None else place)
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
