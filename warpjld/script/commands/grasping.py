"""Bending joints until skin touches an object, closing hands on it, and letting go (A §7, §9)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import read_object
from warpjld.script.facets import read_facet, read_vertex
from warpjld.script.grips import read_frames, read_side
from warpjld.script.keys import DIGIT_WORDS, named_joint
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.skeleton import CHANNELS

if TYPE_CHECKING:
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor

_AUTO = "<key> [LEFT/RIGHT] {}<hand vertex or PAD> <object> <facet or NEAREST> [DISTANCE <metres>] [WITHIN <metres>]"


@command(
    "AUTO_WRIST",
    syntax=f"AUTO_WRIST {_AUTO.format('')}",
    help="Wrist flexion that brings a vertex to an object: the nearest, either way, or out of it; WITHIN: how exactly.",
    group="Grasping",
)
def auto_wrist(scene: Scene, arguments: Arguments) -> None:
    """Flexion of the wrist at a key with which a vertex of the hand touches an object (R86)."""
    key = arguments.number("the key (a frame)")
    side = read_side(scene, arguments)
    _search(scene, arguments, "AUTO_WRIST", key, side, "wrist", "middle")


@command(
    "AUTO_F_1",
    syntax=f"AUTO_F_1 {_AUTO.format('<THUMB/INDEX/MIDDLE/RING/PINKY> ')}",
    help="Flexion at the base of a finger with which a vertex touches an object.",
    group="Grasping",
)
def auto_f_1(scene: Scene, arguments: Arguments) -> None:
    """Flexion at the base of a finger with which a vertex touches an object (R87)."""
    key = arguments.number("the key (a frame)")
    side = read_side(scene, arguments)
    finger = arguments.choice("the finger", DIGIT_WORDS).lower()
    _search(scene, arguments, "AUTO_F_1", key, side, f"{finger}.base", finger)


@command(
    "AUTO_F_2_3",
    syntax=f"AUTO_F_2_3 {_AUTO.format('<THUMB/INDEX/MIDDLE/RING/PINKY> <KNUCKLES2/KNUCKLES3> ')}",
    help="Flexion of a finger's second or third joint with which a vertex touches an object.",
    group="Grasping",
)
def auto_f_2_3(scene: Scene, arguments: Arguments) -> None:
    """Flexion of a finger's second or third joint with which a vertex touches an object (R87)."""
    key = arguments.number("the key (a frame)")
    side = read_side(scene, arguments)
    finger, knuckle = arguments.choices(DIGIT_WORDS, ("KNUCKLES2", "KNUCKLES3"))
    joint = f"{finger}.{knuckle.replace('KNUCKLES', 'knuckle')}".lower()
    _search(scene, arguments, "AUTO_F_2_3", key, side, joint, finger.lower())


@command(
    "GRASP",
    syntax=(
        "GRASP <key1> <key2> [LEFT/RIGHT] <object> [THUMB/INDEX/MIDDLE/RING/PINKY …] "
        "[COUPLING <second joint> <third joint>], or GRASP <key1> <key2> [LEFT/RIGHT] <object> AUTO "
        "[TRIES <placements>] [POSTURE <SPHERE/CYLINDER/PINCH/PLATE>]"
    ),
    help="Digits close from key1 on and touch at key2; COUPLING bends joints together; AUTO finds a way to take it.",
    group="Grasping",
)
def grasp(scene: Scene, arguments: Arguments) -> None:
    """Digits close from key1 on and touch at key2 (R90)."""
    from warpjld.script.grasping import close_digits

    first, last = read_frames(arguments, "at which the digits begin to close", "at which they touch")
    side = read_side(scene, arguments)
    prop = read_object(scene, arguments)
    _check_size(scene.actor_with(side), prop, arguments)
    if arguments.keyword("AUTO"):
        _grasp_auto(scene, arguments, side, prop, first, last)
        return
    digits = []
    while digit := arguments.keyword(*DIGIT_WORDS):
        digits.append(f"{side}.{digit.lower()}")
    options = arguments.options(
        coupling=lambda: (
            arguments.number("the second joint's rate", minimum=0.0, maximum=10.0),
            arguments.number("the third joint's rate", minimum=0.0, maximum=10.0),
        )
    )
    coupling = cast("tuple[float, float] | None", options.get("coupling"))
    actor = scene.actor_with(side)
    if scene.dry:
        _leave_keys(scene, actor, prop, side, first, last, digits)
        return
    scene.attempts.append(close_digits(scene, actor, prop, side, first, last, digits, coupling))


def _check_size(actor: Actor, prop: Prop, arguments: Arguments) -> None:
    """Refuse an object read in a unit that nobody stated, where its size is absurd beside the hand."""
    from warpjld.grasp.hand_scale import doubt_of_size, hand_length

    if prop.assumed is not None:
        doubt = doubt_of_size(prop.thing, hand_length(actor.skeleton), prop.assumed)
        if doubt is not None:
            meant = f"; if it is meant so, say UNIT {prop.assumed.upper()}"
            raise arguments.error(f"{prop.name} {doubt}{meant}")


def _grasp_auto(  # type: ignore[no-untyped-def]
    scene: Scene, arguments: Arguments, side: str, prop, first: float, last: float
) -> None:
    from warpjld.grasp.postures import POSTURES
    from warpjld.script.grasp_auto import grasp_by_itself

    options = arguments.options(
        tries=lambda: arguments.integer("the number of placements to try", minimum=1, maximum=100_000),
        posture=lambda: arguments.choice("the posture", [name.upper() for name in POSTURES]).lower(),
    )
    tries, posture = int(cast(int, options.get("tries", 96))), cast("str | None", options.get("posture"))
    actor = scene.actor_with(side)
    if scene.dry:
        _leave_keys(scene, actor, prop, side, first, last, ())
        return
    scene.attempts.append(grasp_by_itself(scene, actor, prop, side, first, last, tries, posture))


def _leave_keys(
    scene: Scene, actor: Actor, prop: Prop, side: str, first: float, last: float, digits: Sequence[str]
) -> None:
    """Keys where a grasp would have them, all as the joints are: what follows it in the script can be checked."""
    from warpjld.grasp.digits import digit_chains
    from warpjld.script.grasping import Attempt

    wanted = list(digits) or [name for name in digit_chains(actor.skeleton) if name.startswith(f"{side}.")]
    grip = {}
    for joint in (joint for chain in digit_chains(actor.skeleton, wanted).values() for joint in chain):
        channel = f"{actor.skeleton.names[joint]}.flexion"
        rest = actor.value(channel, first)
        actor.set_keys(channel, [first, last], rest, scene.spline)
        grip[channel] = rest
    scene.grips[actor.name] = scene.grips.get(actor.name, {}) | grip
    message = "not searched: nothing is computed by --check"
    scene.attempts.append(Attempt(f"GRASP {prop.name}", last, actor.name, prop.name, "NOT_SEARCHED", message, {}))


@command(
    "RELEASE",
    syntax="RELEASE <key1> <key2> [LEFT/RIGHT]",
    help="Digits closed by GRASP open again from key1 on; at key2 they are as before it.",
    group="Grasping",
)
def release(scene: Scene, arguments: Arguments) -> None:
    """Digits closed by GRASP open again from key1 on; at key2 they are as before it (R69)."""
    first, last = read_frames(arguments, "at which the digits begin to open", "at which they are open")
    actor = scene.actor_with(read_side(scene, arguments))
    if actor.name not in scene.grips:
        raise arguments.error(f"actor {actor.name} has grasped nothing", arguments.position)
    for channel, value in scene.grips.pop(actor.name).items():
        keys = actor.motion.tracks[channel].keys
        # the last key's own value, to the bit: only then do splines hold it
        held = keys[-1].value if keys[-1].frame <= first else actor.value(channel, first)
        actor.set_keys(channel, [first], held, scene.spline)
        actor.set_keys(channel, [last], value, scene.spline)


def _search(scene: Scene, arguments: Arguments, name: str, key: float, side: str, joint_name: str, finger: str) -> None:
    from warpjld.grasp import SearchStatus
    from warpjld.grasp.digits import pad_vertex
    from warpjld.grasp.search import FINEST
    from warpjld.script.binding import cover
    from warpjld.script.grasping import Attempt, search_flexion

    actor = scene.actor_with(side)
    joint = named_joint(actor, f"{side}.{joint_name}", arguments)
    if arguments.keyword("PAD"):
        vertex = -1 if scene.dry else pad_vertex(cover(actor), f"{side}.{finger}".lower())
    else:
        vertex = read_vertex(actor, arguments, "the hand vertex (its number in the file, or PAD)")
    prop = read_object(scene, arguments)
    _check_size(actor, prop, arguments)
    if arguments.keyword("NEAREST"):
        facet = None
    else:
        facet = read_facet(prop, arguments, "the facet (its number in the file, or NEAREST)")
    options = arguments.options(
        distance=lambda: arguments.number("the distance in metres"),
        within=lambda: arguments.number("how exactly, in metres", minimum=FINEST, maximum=0.1),
    )
    distance, within = (float(cast(float, options.get(k, v))) for k, v in (("distance", 0.0), ("within", 1e-6)))
    if scene.dry:
        actor.set_keys(f"{actor.skeleton.names[joint]}.{CHANNELS[0]}", [key], 0.0, scene.spline)
        return
    found, inside = search_flexion(scene, actor, prop, key, joint, vertex, facet, distance, within)
    status = SearchStatus(int(found.status[0]))
    message = found.message()
    if status is SearchStatus.CONVERGED:
        channel = f"{actor.skeleton.names[joint]}.{CHANNELS[0]}"
        actor.set_keys(channel, [key], float(found.angles[0, 0]), scene.spline)
        if inside != "no vertex inside":
            message += f"; not solved: {inside}"
    number = int(actor.rig.surface.numbers[vertex])
    values = {
        "joint": actor.skeleton.names[joint],
        "vertex": number,
        "facet": prop.thing.facet_of(int(found.facet[0])) if found.facet[0] >= 0 else -1,
        "angle_degrees": round(math.degrees(found.angles[0, 0]), 4),
        "distance_mm": round(1e3 * float(found.distance[0]), 4),
        "collisions": inside,
    }
    what = f"{name} {actor.skeleton.names[joint]} vertex {number} {prop.name}"
    scene.attempts.append(Attempt(what, key, actor.name, prop.name, status.name, message, values))
