"""Commands for flexion searches (AUTO_WRIST, AUTO_F_1, AUTO_F_2_3), GRASP and RELEASE (A §7, §9)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from warpjld.errors import InputError
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
    help="Find the wrist flexion at which a vertex touches an object, nearest to the present angle; WITHIN: tolerance.",
    group="Grasping",
)
def auto_wrist(scene: Scene, arguments: Arguments) -> None:
    """Find the flexion of the wrist at a key with which a vertex of the hand touches an object (R86)."""
    key = arguments.number("the key (a frame)")
    side = read_side(scene, arguments)
    _search(scene, arguments, "AUTO_WRIST", key, side, "wrist", "middle")


@command(
    "AUTO_F_1",
    syntax=f"AUTO_F_1 {_AUTO.format('<THUMB/INDEX/MIDDLE/RING/PINKY> ')}",
    help="Find the flexion at the base of a finger at which a vertex touches an object.",
    group="Grasping",
)
def auto_f_1(scene: Scene, arguments: Arguments) -> None:
    """Find the flexion at the base of a finger at which a vertex touches an object (R87)."""
    key = arguments.number("the key (a frame)")
    side = read_side(scene, arguments)
    finger = arguments.choice("the finger", DIGIT_WORDS).lower()
    _search(scene, arguments, "AUTO_F_1", key, side, f"{finger}.base", finger)


@command(
    "AUTO_F_2_3",
    syntax=f"AUTO_F_2_3 {_AUTO.format('<THUMB/INDEX/MIDDLE/RING/PINKY> <KNUCKLES2/KNUCKLES3> ')}",
    help="Find the flexion of a finger's second or third joint at which a vertex touches an object.",
    group="Grasping",
)
def auto_f_2_3(scene: Scene, arguments: Arguments) -> None:
    """Find the flexion of a finger's second or third joint at which a vertex touches an object (R87)."""
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
        "[THUMB/INDEX/MIDDLE/RING/PINKY …] [TRIES <placements>] [POSTURE <SPHERE/CYLINDER/PINCH/PLATE>], or "
        "GRASP <key1> <key2> BOTH <object> AUTO [TRIES <placements>]"
    ),
    help="Close digits on an object between key1 and key2; COUPLING flexes joints together; AUTO also places the "
    "hand, BOTH two.",
    group="Grasping",
)
def grasp(scene: Scene, arguments: Arguments) -> None:
    """Close digits on an object between key1 and key2 (R90)."""
    from warpjld.script.grasping import close_digits

    first, last = read_frames(arguments, "at which the digits begin to close", "at which they touch")
    if arguments.keyword("BOTH"):
        _grasp_both(scene, arguments, first, last)
        return
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
    """Refuse an object whose unit was assumed and whose size is implausible beside the hand.

    Raises:
        InputError: It is; names the units that would be plausible.
    """
    from warpjld.grasp.hand_scale import doubt_of_size, hand_length

    if prop.assumed is not None:
        doubt = doubt_of_size(prop.thing, hand_length(actor.skeleton), prop.assumed)
        if doubt is not None:
            meant = f"; if that is its size, say UNIT {prop.assumed.upper()}"
            raise arguments.error(f"{prop.name} {doubt}{meant}")


def _grasp_auto(  # type: ignore[no-untyped-def]
    scene: Scene, arguments: Arguments, side: str, prop, first: float, last: float
) -> None:
    """GRASP … AUTO: read its digits and options, search, and set the keys."""
    from warpjld.grasp.find_grasp import check_opposing
    from warpjld.grasp.postures import POSTURES
    from warpjld.script.grasp_auto import grasp_by_itself

    digits = []
    while digit := arguments.keyword(*DIGIT_WORDS):
        digits.append(digit.lower())
    try:
        check_opposing(digits)
    except InputError as error:
        raise arguments.error(error.message) from error
    options = arguments.options(
        tries=lambda: arguments.integer("the number of placements to try", minimum=1, maximum=100_000),
        posture=lambda: arguments.choice("the posture", [name.upper() for name in POSTURES]).lower(),
    )
    tries, posture = int(cast(int, options.get("tries", 96))), cast("str | None", options.get("posture"))
    actor = scene.actor_with(side)
    if scene.dry:
        _leave_keys(scene, actor, prop, side, first, last, ())
        return
    scene.attempts.append(grasp_by_itself(scene, actor, prop, side, first, last, tries, posture, digits))


def _grasp_both(scene: Scene, arguments: Arguments, first: float, last: float) -> None:
    """GRASP … BOTH … AUTO: read its arguments, search with both hands, and set the keys."""
    from warpjld.script.grasp_both import both_hands, grasp_by_both

    prop = read_object(scene, arguments)
    if not arguments.keyword("AUTO"):
        raise arguments.expected("AUTO: two hands are always placed by the search")
    options = arguments.options(
        tries=lambda: arguments.integer("the number of placements to try", minimum=1, maximum=100_000),
    )
    actors = both_hands(scene)
    for actor in actors.values():
        _check_size(actor, prop, arguments)
    if scene.dry:
        for side, actor in actors.items():
            _leave_keys(scene, actor, prop, side, first, last, ())
        return
    scene.attempts.extend(grasp_by_both(scene, prop, first, last, int(cast(int, options.get("tries", 96)))))


def _leave_keys(
    scene: Scene, actor: Actor, prop: Prop, side: str, first: float, last: float, digits: Sequence[str]
) -> None:
    """Set keys at a grasp's frames to the present angles, without a search, so that later lines can be checked."""
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
    help="Open digits that GRASP closed: from key1 on, until at key2 they have their angles from before the grasp.",
    group="Grasping",
)
def release(scene: Scene, arguments: Arguments) -> None:
    """Open digits that GRASP closed, from key1 to key2, to their angles from before the grasp (R69)."""
    first, last = read_frames(arguments, "at which the digits begin to open", "at which they are open")
    actor = scene.actor_with(read_side(scene, arguments))
    if actor.name not in scene.grips:
        raise arguments.error(f"actor {actor.name} has grasped nothing", arguments.position)
    scene.idle.pop(actor.name, None)
    for channel, value in scene.grips.pop(actor.name).items():
        keys = actor.motion.tracks[channel].keys
        # exactly the last key's value, so that the spline between the two is constant
        held = keys[-1].value if keys[-1].frame <= first else actor.value(channel, first)
        actor.set_keys(channel, [first], held, scene.spline)
        actor.set_keys(channel, [last], value, scene.spline)


def _search(scene: Scene, arguments: Arguments, name: str, key: float, side: str, joint_name: str, finger: str) -> None:
    """Read vertex, object, facet and options of a flexion search, run it, and set the key if it converged."""
    from warpjld.grasp import SearchStatus
    from warpjld.grasp.digits import pad_vertex
    from warpjld.grasp.search import FINEST
    from warpjld.script.binding import cover
    from warpjld.script.grasping import Attempt, moves_vertex, search_flexion

    actor = scene.actor_with(side)
    joint = named_joint(actor, f"{side}.{joint_name}", arguments)
    if arguments.keyword("PAD"):
        vertex = -1 if scene.dry else pad_vertex(cover(actor), f"{side}.{finger}".lower())
    else:
        vertex = read_vertex(actor, arguments, "the hand vertex (its number in the file, or PAD)")
    where = arguments.last
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
    if not moves_vertex(scene, actor, key, joint, vertex):
        number, bends = int(actor.rig.surface.numbers[vertex]), actor.skeleton.names[joint]
        raise arguments.error(
            f"{actor.name} vertex {number} does not move when {bends} bends: want one that does", where
        )
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
