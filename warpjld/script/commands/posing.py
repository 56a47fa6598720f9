"""Command POSE: a whole hand pose at a key, from the library or a file."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from warpjld.script.arguments import Arguments
from warpjld.script.keys import SIDES
from warpjld.script.pose_files import SHIPPED, hand_channels, load_pose, shipped_pose
from warpjld.script.registry import command
from warpjld.script.scene import Scene


@command(
    "POSE",
    syntax=f"POSE <LEFT/RIGHT> <{'/'.join(SHIPPED).upper()}> <key> [SHARE <percent>] or "
    'POSE <LEFT/RIGHT> "<pose file>" <key> [SHARE <percent>]',
    help="Set all digits to a pose at a key, from the library or a file; SHARE: blend with the present pose.",
    group="Animation",
)
def pose(scene: Scene, arguments: Arguments) -> None:
    """Set all digits to a pose at a key, or blend the present pose with it."""
    side = arguments.choice("the side", SIDES).lower()
    if arguments.has_text():
        wanted = load_pose(arguments.input_file("a pose file"))
    else:
        wanted = shipped_pose(arguments.choice("a pose or a file in quotes", [name.upper() for name in SHIPPED]))
    key = arguments.number("the key (a frame)")
    options = arguments.options(share=lambda: arguments.number("the share in percent", minimum=0, maximum=100))
    share = cast(float, options.get("share", 100.0)) / 100.0
    actor = scene.actor_with(side)
    if actor.recorded is not None:
        raise arguments.error(f"actor {actor.name} is driven by a MOTION file: no keys can be set", arguments.position)
    for name, (low, high) in hand_channels(actor, side).items():
        channel = f"{side}.{name}"
        now = np.degrees(actor.value(channel, key))
        degrees = min(max(now + share * (wanted.get(name, 0.0) - now), low), high)
        actor.set_keys(channel, [key], math.radians(degrees), scene.spline)
