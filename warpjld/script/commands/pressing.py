"""Solving contact over frames, and what to write of it (B §3.3, R110–R125)."""

from __future__ import annotations

import math

from warpjld.press.wishes import Pressing
from warpjld.script.arguments import Arguments
from warpjld.script.commands.animation import SIDES
from warpjld.script.commands.output import ask_for
from warpjld.script.commands.physical import place
from warpjld.script.formats import TABLES, VOLUMES
from warpjld.script.registry import command
from warpjld.script.scene import Scene, Table, Volume


@command(
    "PRESS",
    syntax='PRESS <first> <last> [EVERY <frames>] [METHOD <AUGMENTED/PAPER>] [AITKEN] [STOP] [STATE "<file>.npz"]',
    help=("Solve contact at these frames; STOP where the muscles can do no more; a run cut off goes on from STATE."),
    group="Contact",
)
def press(scene: Scene, arguments: Arguments) -> None:
    """R110, R113, R118."""
    first = arguments.integer("the first frame")
    last = arguments.integer("the last frame")
    if last <= first:
        raise arguments.error(f"the last frame must come after the first ({first}), got {last}")
    options = arguments.options(
        every=lambda: arguments.integer("the frames between two that are solved", minimum=1),
        method=lambda: arguments.choice("the method", ("AUGMENTED", "PAPER")).lower(),
        aitken=lambda: True,
        stop=lambda: True,
        state=lambda: arguments.output_name("the file of the state", (".npz",)),
    )
    if options.get("aitken") and options.get("method") != "paper":
        raise arguments.error("AITKEN relaxes the paper's loop: it goes with METHOD PAPER")
    if not (scene.contact.flesh or scene.contact.physical):
        raise arguments.error("nothing deforms: make a body do so with FLESH or PHYSICAL first", arguments.position)
    scene.contact.pressing = Pressing(first, last, **options, where=place(arguments))  # type: ignore[arg-type]


@command(
    "SQUEEZE",
    syntax="SQUEEZE <key1> <key2> [LEFT/RIGHT] <degrees>",
    help="Digits closed by GRASP bend on from key1 to key2, each joint by up to this much: into the object.",
    group="Contact",
)
def squeeze(scene: Scene, arguments: Arguments) -> None:
    """R112: fingers may end inside the object; contact says what comes of it."""
    from warpjld.skeleton import CHANNELS

    first = arguments.number("key1 (the frame from which on the digits press)")
    last = arguments.number("key2 (the frame at which they press most)")
    if last <= first:
        raise arguments.error(f"key2 must come after key1 ({first:g}), got {last:g}")
    side = arguments.keyword(*SIDES)
    actor = scene.actor_with(side) if side else scene.actor()
    degrees = arguments.number("the angle in degrees", minimum=-90, maximum=90)
    if actor.name not in scene.grips:
        raise arguments.error(
            f"actor {actor.name} has grasped nothing: there is no grip to tighten", arguments.position
        )
    for channel in scene.grips[actor.name]:
        joint, _, kind = channel.rpartition(".")
        if kind != "flexion":
            continue
        now = float(actor.motion.value(channel, first))
        low, high = actor.skeleton.limits[actor.skeleton.index(joint), CHANNELS.index(kind)]
        if now > 1e-9 or not joint.endswith(("knuckle2", "knuckle3")):
            actor.set_keys(channel, [first], now, scene.spline)
            actor.set_keys(channel, [last], min(max(now + math.radians(degrees), low), high), scene.spline)


@command(
    "TABLE",
    syntax=f'TABLE "<name>{"/".join(TABLES)}"',
    help="A table by frame and digit: force, area, peak pressure, bone reaction, share of the muscles' limit, sliding.",
    group="Output",
)
def table(scene: Scene, arguments: Arguments) -> None:
    """R95, R118."""
    ask_for(scene, arguments, Table(arguments.output_name("the table's name", TABLES)))


@command(
    "VOLUME",
    syntax=f'VOLUME "<name>{"/".join(VOLUMES)}"',
    help="The deformed volumes with their stresses at the frames that PRESS solves, for ParaView.",
    group="Output",
)
def volume(scene: Scene, arguments: Arguments) -> None:
    """R95: internal stresses."""
    ask_for(scene, arguments, Volume(arguments.output_name("the series' name", VOLUMES)))
