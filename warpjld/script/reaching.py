"""REACH: inverse kinematics of an arm with a fixed trunk, avoiding the body; sets the arm's keys (A §7, R90)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.script.arm_way import clear_way, key_arm, pierced_frames
from warpjld.script.binding import cover
from warpjld.script.grasping import Attempt, placed_at, posture
from warpjld.skeleton import Poses, poses_from_angles

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.grasp.arm_clearance import ArmClearance
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene
    from warpjld.skeleton.arm import Arm
    from warpjld.skeleton.reach import Reached

__all__ = ["REACHED", "Goal", "arm_to_hand", "nearest_side", "reach_for"]

REACHED = 0.002
"""Distance up to which a goal counts as reached [m]."""
_ROUNDS = 4  # largest number of solutions; each uses the skin's offset from the previous one
_SETTLED = 2e-4  # change of the skin's offset from the wrist at which the iteration ends [m]
_MARGINS = (0.0, 0.01, 0.02)
"""Added to the radii of the arm's spheres [m] in searches that put the body's skin before the target, one after another
as long as the arm's skin passes through it: spheres have the arm's thin side."""


@dataclass(frozen=True, eq=False)
class Goal:
    """Goal of a reach.

    Attributes:
        name: Name of the object, or ``(x, y, z)``, for messages.
        object: Name of the object; empty for a point.
        place: World position to reach [m], shape (3,).
        look: Wanted palm normal, a unit vector; None: any.
        part: Part of the hand that reaches: ``palm``, ``wrist``, or the pad of a digit (``index``).
    """

    name: str
    object: str
    place: NDArray[np.float64]
    look: NDArray[np.float64] | None
    part: str


def reach_for(scene: Scene, actor: Actor, side: str, first: float, last: float, goal: Goal) -> Attempt:
    """Find the arm's angles at ``last`` and set keys: the present angles at ``first``, those found at ``last``.

    Raises:
        InputError: No arm, or an actor that a motion file drives.
    """
    from warpjld.grasp.arm_clearance import ArmClearance
    from warpjld.skeleton.arm import arm_of

    arm = arm_of(actor.skeleton, side)
    covering = cover(actor)
    poses, angles = posture(scene, actor, last)
    clearance = ArmClearance(covering, arm, poses)
    _, before = posture(scene, actor, first)
    key_arm(scene, actor, arm, first, arm.values(before[0]))
    for margin in (None, *_MARGINS):
        room = clearance if margin is None else clearance.wider(margin)
        found, at = _solved(scene, actor, covering, arm, poses, angles[0], last, goal, room, margin is not None)
        key_arm(scene, actor, arm, last, arm.values(found.angles))
        pierced = pierced_frames(scene, actor, covering, arm, first, last)
        if not pierced[last]:
            break
    pierced = clear_way(scene, actor, arm, first, last, pierced)
    short = float(np.linalg.norm(at - goal.place))
    status = "CONVERGED" if short <= REACHED else "SHORT"
    if pierced[last]:
        status = "PIERCES"
    values = {
        "short_mm": round(1e3 * short, 3),
        "palm_off_degrees": round(math.degrees(found.off), 2),
        "pierced_faces": {f"{frame:g}": count for frame, count in pierced.items() if count},
    }
    message = _message(goal, short, found, pierced, last)
    if status != "CONVERGED":
        scene.warned([f"{actor.name}: REACH {goal.name} at frame {last:g}: {message}"])
    return Attempt(f"REACH {goal.name}", last, actor.name, goal.object, status, message, values)


def arm_to_hand(
    scene: Scene, actor: Actor, arm: Arm, clearance: ArmClearance, frame: float, hand: Poses
) -> tuple[Reached, int]:
    """Posture of the arm at a frame that gives the hand its position and rotation in another pose.

    Args:
        scene: The scene.
        actor: The body.
        arm: Its arm.
        clearance: Penetration depths of the arm in the body.
        frame: The frame.
        hand: Pose of the same skeleton with the hand as wanted, one frame.

    Returns:
        The posture, and the number of faces of the body that the arm passes through.
    """
    from warpjld.geometry.rotations import matrices
    from warpjld.grasp.arm_clearance import pierced_faces
    from warpjld.skeleton.reach import Target, reach

    wrist = arm.joints[-1]
    poses, angles = posture(scene, actor, frame)
    turn = matrices(hand.rotations[0, wrist])
    aims = tuple((axis, turn @ axis) for axis in np.eye(3)[:2])
    target = Target(hand.positions[0, wrist], np.zeros(3), aims, exact=True)
    found = reach(arm, angles[0], poses, target, depths=clearance)
    _, root = actor.motion.sample(np.array([frame]), actor.skeleton)
    body = poses_from_angles(arm.skeleton, found.angles[None], root_position=root)
    covering = cover(actor)
    skin = covering.deform(actor.placement.apply(body, np.array([frame])))[0]
    return found, len(pierced_faces(covering, arm, skin))


def nearest_side(
    scene: Scene, actor: Actor, side: str, prop: Prop, key: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Point of an object nearest to a shoulder [m], and the unit direction from the shoulder to it."""
    from trimesh.triangles import closest_point

    poses, _ = posture(scene, actor, key)
    shoulder = poses.positions[0, actor.skeleton.index(f"{side}.shoulder")]
    thing = placed_at(scene, prop, key)
    corners = thing.place.apply(thing.vertices)[0][thing.faces]
    points = closest_point(corners, np.repeat(shoulder[None], len(corners), axis=0))
    place = points[np.linalg.norm(points - shoulder, axis=1).argmin()]
    return np.asarray(place), unit(place - shoulder)


def _solved(
    scene: Scene,
    actor: Actor,
    covering: Covering,
    arm: Arm,
    poses: Poses,
    angles: NDArray[np.float64],
    key: float,
    goal: Goal,
    clearance: ArmClearance,
    firm: bool,
) -> tuple[Reached, NDArray[np.float64]]:
    """Posture of the arm, and the position that the part of the hand then has [m], shape (3,).

    The skin's offset from the wrist depends on the posture; it is updated in a fixed-point iteration.
    """
    from warpjld.grasp.digits import pad_vertex
    from warpjld.grasp.palm import palm_of
    from warpjld.skeleton.reach import Target, reach

    side = arm.skeleton.names[arm.joints[-1]].partition(".")[0]
    palm = palm_of(arm.skeleton, side)
    vertex = None
    if goal.part == "palm":
        middle = palm.on_skin(covering.surface.vertices).middle
        vertex = int(np.linalg.norm(covering.surface.vertices - middle, axis=1).argmin())
    elif goal.part != "wrist":
        vertex = pad_vertex(covering, f"{side}.{goal.part}")

    def part_of(body: Poses) -> NDArray[np.float64]:
        if vertex is None:
            return np.asarray(body.positions[0, arm.joints[-1]])
        return np.asarray(covering.points(body, [vertex])[0, 0], dtype=np.float64)

    _, root = actor.motion.sample(np.array([key]), actor.skeleton)
    body, offset, near = poses, arm.carried(part_of(poses), poses), None
    for _ in range(_ROUNDS):
        target = Target(goal.place, offset, () if goal.look is None else ((palm.normal, goal.look),))
        found = reach(arm, angles, poses, target, depths=clearance, start=near, firm=firm)
        near = arm.values(found.angles)
        body = actor.placement.apply(
            poses_from_angles(arm.skeleton, found.angles[None], root_position=root), np.array([key])
        )
        now = arm.carried(part_of(body), body)
        if float(np.linalg.norm(now - offset)) < _SETTLED:
            break
        offset = now
    return found, part_of(body)


def _message(goal: Goal, short: float, found: Reached, pierced: dict[float, int], last: float) -> str:
    """Readable text about the result of a reach."""
    if short > REACHED:
        text = f"out of reach: the {goal.part} comes within {1e3 * short:.0f} mm of it; the nearest posture is keyed"
    else:
        text = f"the {goal.part} is there to {1e3 * short:.2f} mm"
    if goal.look is not None and math.degrees(found.off) > 5.0:
        text += f"; the palm is turned {math.degrees(found.off):.0f}° from it"
    if pierced[last]:
        text += f"; the arm passes through {pierced[last]} faces of the body"
    if way := [f"{frame:.4g}" for frame, count in pierced.items() if count and frame != last]:
        text += f"; on its way the arm passes through the body at frame {', '.join(way)}"
    return text
