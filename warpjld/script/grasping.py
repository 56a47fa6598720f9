"""Flexion searches and closing of hands in a script, their results (``Attempt``), and reports of contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.script.binding import cover
from warpjld.script.props import prop_places
from warpjld.script.staging import stage
from warpjld.skeleton import Poses

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject, SearchResult
    from warpjld.script.crowd import Crowd
    from warpjld.script.facets import Facet
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = [
    "Attempt",
    "close_digits",
    "collisions",
    "contact_reports",
    "moves_vertex",
    "placed_at",
    "posture",
    "search_flexion",
]


_LOOKS = 6  # frames of a closing motion at which collisions with other objects are tested
_STILL = 1e-6  # what moves less by a bend of half a radian does not move: rounding of single precision [m]


@dataclass(frozen=True)
class Attempt:
    """Result of a search or grasp command, for the summary.

    Attributes:
        command: The command with its main arguments.
        frame: Frame of the key.
        actor: Name of the actor.
        object: Name of the object; empty where there is none.
        status: Name of the status, see docs/reference/statuses.md.
        message: Readable text.
        values: Further results, as JSON values.
    """

    command: str
    frame: float
    actor: str
    object: str
    status: str
    message: str
    values: dict[str, Any]

    def content(self) -> dict[str, Any]:
        """As a dictionary of JSON values."""
        plain = {k: getattr(self, k) for k in ("command", "frame", "actor", "object", "status", "message")}
        return plain | self.values


def posture(scene: Scene, actor: Actor, key: float) -> tuple[Poses, NDArray[np.float64]]:
    """Pose and joint angles (1, J, 4) of an actor at a frame.

    Raises:
        InputError: It is driven by a motion file, which has no angles to change.
    """
    if actor.recorded is not None:
        raise InputError(f"actor {actor.name} is driven by a MOTION file: no angle can be searched")
    moment = np.array([key])
    angles, _ = actor.motion.sample(moment, actor.skeleton)
    return stage(actor, moment, scene.rate), angles


def placed_at(scene: Scene, prop: Prop, key: float) -> GraspObject:
    """An object with its shape and placement at a frame."""
    there = prop_places(scene.actors, scene.rate, prop, np.array([key]))
    thing = replace(prop.thing, vertices=prop.shape(key)) if prop.deforms else prop.thing
    return thing.placed(there.position[0], there.rotation[0])


def moves_vertex(scene: Scene, actor: Actor, key: float, joint: int, vertex: int) -> bool:
    """Whether a welded vertex of the actor's surface moves when a joint bends at a frame."""
    from warpjld.skeleton import poses_from_angles
    from warpjld.skeleton.channels import FLEXION

    _, angles = posture(scene, actor, key)
    bent = np.repeat(angles, 2, axis=0)
    bent[1, joint, FLEXION] += 0.5
    first, last = cover(actor).points(poses_from_angles(actor.skeleton, bent), [vertex])[:, 0]
    return bool(np.linalg.norm(last - first) > _STILL)


def search_flexion(
    scene: Scene,
    actor: Actor,
    prop: Prop,
    key: float,
    joint: int,
    vertex: int,
    facet: Facet | None,
    distance: float,
    within: float,
) -> tuple[SearchResult, str]:
    """Search for the flexion of a joint at which a vertex has a given distance to an object (R77).

    Args:
        scene: The scene.
        actor: The actor.
        prop: The object.
        key: The frame.
        joint: Joint that flexes.
        vertex: Welded vertex of the actor's surface.
        facet: Facet of the object, or None for the nearest.
        distance: Target distance [m].
        within: Tolerance [m].

    Returns:
        The result nearest to the present angle, and a text about vertices of the hand that are then inside the object.
    """
    from warpjld.grasp import NEAREST, FlexionSearch, ObjectSet, Searches
    from warpjld.grasp.intersection import intersection
    from warpjld.skeleton import poses_from_angles

    covering = cover(actor)
    poses, angles = posture(scene, actor, key)
    thing = placed_at(scene, prop, key)
    triangle = NEAREST if facet is None else int(facet.triangles[0])
    wanted = Searches(vertex=vertex, joint=joint, facet=triangle, distance=distance)
    found = FlexionSearch(covering, ObjectSet(thing, device=scene.device)).nearest(
        poses, angles, wanted, tolerance=within
    )
    angles[0, joint, 0] = found.angles[0, 0]
    _, root = actor.motion.sample(np.array([key]), actor.skeleton)
    bent = actor.placement.apply(poses_from_angles(actor.skeleton, angles, root_position=root), np.array([key]))
    skin = covering.deform(bent)[0]
    if facet is not None:  # the foot may lie in any of the facet's triangles
        found = replace(found, inside=np.array([facet.coordinates(skin[vertex], thing)[1]]))
    return found, str(intersection(covering, skin, thing))


def close_digits(
    scene: Scene,
    actor: Actor,
    prop: Prop,
    side: str,
    first: float,
    last: float,
    digits: Sequence[str],
    coupling: tuple[float, float] | None,
) -> Attempt:
    """Close digits on an object and set keys: of the open hand at ``first``, of the closed one at ``last``."""
    from warpjld.grasp import SearchStatus
    from warpjld.grasp.close import Closer
    from warpjld.grasp.digits import digit_chains
    from warpjld.grasp.intersection import intersection

    covering = cover(actor)
    poses, angles = posture(scene, actor, last)
    thing = placed_at(scene, prop, last)
    wanted = list(digits) or [name for name in digit_chains(actor.skeleton) if name.startswith(f"{side}.")]
    closed = Closer(covering, thing, device=scene.device).close(poses, angles, digits=wanted, coupling=coupling)
    chains = digit_chains(actor.skeleton, wanted)
    grip = {}
    for name in closed.digits:
        for joint in chains[name]:
            channel = f"{actor.skeleton.names[joint]}.flexion"
            before = actor.value(channel, first)
            grip[channel] = before
            actor.set_keys(channel, [first], before, scene.spline)
            actor.set_keys(channel, [last], float(closed.angles[0, joint, 0]), scene.spline)
    scene.grips[actor.name] = scene.grips.get(actor.name, {}) | grip
    scene.idle[actor.name] = scene.idle.get(actor.name, set()) - grip.keys()
    poses, _ = posture(scene, actor, last)
    inside = intersection(covering, covering.deform(poses)[0], thing)
    touching = closed.touching()[0]
    rows = {name: [SearchStatus(int(s)).name for s in closed.status[0, d]] for d, name in enumerate(closed.digits)}
    message = f"{int(touching.sum())} of {len(touching)} digits touch"
    blocked = [name for name, statuses in rows.items() if "BLOCKED" in statuses]
    begun = [name for name, statuses in rows.items() if "INSIDE" in statuses]
    if blocked:
        message += f"; stopped by another digit or the palm: {', '.join(blocked)}"
    if begun:
        message += f"; in the object before closing: {', '.join(begun)}"
    message += f"; {inside}"
    others = collisions(scene, actor, prop, first, last, side)
    message += "".join(f"; {text}" for text in others)
    status = "INSIDE" if begun else ("CONVERGED" if touching.any() else "NO_CONTACT")
    depth = round(1e3 * float(closed.penetration[0]), 4)
    values = {"digits": rows, "penetration_mm": depth, "collisions": others}
    return Attempt(f"GRASP {prop.name}", last, actor.name, prop.name, status, message, values)


def collisions(scene: Scene, actor: Actor, held: Prop, first: float, last: float, side: str = "") -> list[str]:
    """Messages about other objects that the hand of a side enters while it closes, or with no side both (R77).

    What the other arm and hand touch is no matter of this one: they may hold an object of their own.
    """
    from warpjld.grasp.hand_object_gaps import HandObjectGaps
    from warpjld.grasp.obstacles import COLLIDES

    covering, messages = cover(actor), []
    frames = np.linspace(first, last, _LOOKS)
    skins = covering.deform(stage(actor, frames, scene.rate))
    for prop in scene.props.values():
        if prop is held:
            continue
        both = HandObjectGaps(covering, prop.thing, device=scene.device)
        if prop.deforms:
            things = [placed_at(scene, prop, frame) for frame in frames.tolist()]
            shapes = [HandObjectGaps(covering, thing, device=scene.device) for thing in things]
            depths = np.concatenate([shape.depths(skin[None]) for shape, skin in zip(shapes, skins, strict=True)])
        else:
            depths = both.depths(skins, prop_places(scene.actors, scene.rate, prop, frames))
        others = {"left": "right.", "right": "left."}.get(side)
        depths[:, [others is not None and part.startswith(others) for part in both.parts]] = 0.0
        frame, part = np.unravel_index(depths.argmax(), depths.shape)
        if depths[frame, part] > COLLIDES:
            depth = 1e3 * depths[frame, part]
            part_name, moment = both.parts[part], frames[frame]
            messages.append(f"collides with {prop.name}: {part_name} {depth:.2f} mm deep at frame {moment:g}")
    return messages


def contact_reports(scene: Scene, crowd: Crowd) -> list[dict[str, Any]]:
    """Contacts of actors with objects, for the summary: at the keys of searches and grasps, and of attachments."""
    from warpjld.grasp.intersection import contacts

    moments: dict[tuple[str, str], set[float]] = {}
    for attempt in scene.attempts:
        if attempt.object:
            moments.setdefault((attempt.actor, attempt.object), set()).add(attempt.frame)
    for prop in crowd.props:
        for attached in prop.associations:
            moments.setdefault((attached.actor, prop.name), set()).update((attached.start, attached.stop))
    rows = []
    for (actor, name), frames in moments.items():
        role = next(role for role in crowd.roles if role.actor.name == actor)
        for frame in sorted(frames):
            poses = stage(role.actor, np.array([frame]), scene.rate)
            thing = placed_at(scene, scene.prop(name), frame)
            found = contacts(role.covering, role.covering.deform(poses, device=crowd.device)[0], thing)
            parts = [
                {"part": c.part, "vertices": c.vertices, "penetration_mm": round(1e3 * c.deepest, 3)} for c in found
            ]
            message = ", ".join(f"{c.part} {c.vertices} vertices" for c in found) or "nothing touches"
            deepest = max((c.deepest for c in found), default=0.0)
            if found:
                message += f"; deepest penetration {1e3 * deepest:.2f} mm"
            rows.append({"frame": frame, "actor": actor, "object": name, "parts": parts, "message": message})
    return rows
