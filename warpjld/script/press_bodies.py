"""The bodies of a scene's contact: flesh, objects that deform, obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.simulation.specification import FleshWish
from warpjld.simulation.state_variables import Points, Prescribing
from warpjld.simulation.specification import placed
from warpjld.simulation.specification import GripWish
from warpjld.script.binding import cover
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.fem.contact import Obstacle
    from warpjld.fem.hand.flesh_hand import FleshHand
    from warpjld.grasp import Places
    from warpjld.simulation.bodies.flesh_body import Drive
    from warpjld.simulation.bodies.flesh_body import HandBody
    from warpjld.simulation.bodies.object_body import ObjectBody
    from warpjld.simulation.bodies.support import Support
    from warpjld.simulation.bodies.object_mesh import ObjectVolume
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene
    from warpjld.skeleton import Poses

__all__ = ["hand_body", "object_body", "prop_obstacle"]

_ROUNDED = 1e-3
"""Radius of the edges of boxes and cylinders as contact feels them [m]: skin has no corner to lie around."""

_FOOT = 0.05
"""Share of a lifted object's height, from below, whose points hold it until then."""


def hand_body(scene: Scene, actor: Actor, wish: FleshWish, start: float, notes: list[str]) -> HandBody:
    """An actor's flesh, in the shape it has at a frame.

    Raises:
        InputError: It cannot be meshed in that pose; names the line of its FLESH.
    """
    from warpjld.fem.hand.cushion import coarse_note
    from warpjld.fem.hand.flesh_hand import build_flesh_hand
    from warpjld.fem.hand.laws import hand_laws
    from warpjld.simulation.bodies.flesh_body import HandBody
    from warpjld.simulation.bodies.rest_shape import part_of, posed
    from warpjld.simulation.bodies.skin_parts import skin_parts

    poses = stage(actor, np.array([start]), scene.rate)
    skin = cover(actor).deform(poses)[0].astype(np.float64)
    rig = replace(actor.rig, skeleton=actor.skeleton)
    try:
        built = build_flesh_hand(rig, wish.element, name=actor.name.lower())
    except InputError as error:
        what = error.message.replace("spacing:", "ELEMENT:")
        raise placed(InputError(f"FLESH {actor.name}: {what}"), wish.where) from error
    coarse = coarse_note(built, wish.element, wish.digits)
    if coarse is not None:
        notes.append(f"{actor.name}: {coarse}")
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

    drive = _drive(scene, actor, part.hand, start)
    return HandBody(actor.name, part, laws, drive.moves, wish.skin, wish.itself, drive, skin_parts(built))


def _drive(scene: Scene, actor: Actor, hand: FleshHand, start: float) -> Drive:
    from warpjld.simulation.bodies.flesh_body import Drive
    from warpjld.skeleton import poses_from_angles

    def pose(time: float) -> Poses:
        return stage(actor, np.array([start + time]), scene.rate)

    def angles(time: float) -> NDArray[np.float64]:
        return actor.motion.sample([start + time], actor.skeleton)[0][0]

    def posed(bent: NDArray[np.float64], time: float) -> Poses:
        moment = np.array([start + time])
        root = actor.motion.sample(moment, actor.skeleton)[1]
        return actor.placement.apply(poses_from_angles(actor.skeleton, bent[None], root_position=root), moment)

    if actor.recorded is not None:
        return Drive(hand, actor.skeleton, pose)
    return Drive(hand, actor.skeleton, pose, angles, posed)


def object_body(scene: Scene, prop: Prop, start: float, place: Places | None = None) -> ObjectBody:
    """An object that deforms, where it is at a frame or at another place.

    Raises:
        InputError: It cannot be meshed; names the line of its PHYSICAL.
    """
    from warpjld.simulation.bodies.object_body import ObjectBody
    from warpjld.simulation.bodies.object_mesh import object_volume

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
        wish = scene.contact.lifted(prop.name)
        support = None
        if wish is not None:
            volume, support = _lifted(scene, wish, volume)
            if not states:
                foot = _foot(support.axis, scene.contact.pull)
                states.append((Prescribing(foot, held=True), foot.choose(volume.mesh.nodes, volume.mesh.nodes)))
    except InputError as error:
        raise placed(InputError(f"{prop.name}: {error.message}"), physical.where) from error
    return ObjectBody(volume, at, states, start, support)


def _lifted(scene: Scene, wish: GripWish, volume: ObjectVolume) -> tuple[ObjectVolume, Support]:
    """The object with its weight, and what it stands on."""
    from warpjld.simulation.grip.shared_weight import handle_of
    from warpjld.fem.load.loads import volumes
    from warpjld.simulation.bodies.support import Support

    pull = np.array(scene.contact.pull)
    axis = int(np.argmax(np.abs(pull)))
    if wish.weight is not None:
        density = wish.weight / (float(np.abs(pull).max()) * float(volumes(volume.mesh).sum()))
        volume = replace(volume, physical=replace(volume.physical, density=density))
    return volume, Support(handle_of(volume.mesh.nodes), axis)


def _foot(axis: int, pull: tuple[float, float, float]) -> Points:
    """The points a lifted object stands on where none are held."""
    return Points("lower" if pull[axis] < 0.0 else "upper", axis, _FOOT)


def prop_obstacle(scene: Scene, prop: Prop, start: float) -> Obstacle:
    """An object as an obstacle; its time is in frames from ``start``. Built-in shapes are exact, with edges rounded."""
    from warpjld.fem.contact.obstacles.meshes import Keyframed, RigidMesh
    from warpjld.fem.contact.obstacles.solids import Box, Cylinder, Sphere

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
