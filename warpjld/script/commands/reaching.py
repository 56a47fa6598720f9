"""Command REACH: inverse kinematics of an arm, to an object or a point (A §7, R90)."""

from __future__ import annotations

from typing import cast

import numpy as np

from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import read_object
from warpjld.script.grips import read_frames, read_side
from warpjld.script.keys import DIGIT_WORDS
from warpjld.script.registry import command
from warpjld.script.scene import Scene

_PARTS = ("PALM", "WRIST", *DIGIT_WORDS)


@command(
    "REACH",
    syntax="REACH <key1> <key2> [LEFT/RIGHT] <object>, or AT <x> <y> <z>, then [WITH <PALM/WRIST/THUMB/INDEX/…>]",
    help="Move an arm so that palm, wrist or a digit's pad reaches the near side of an object, or a point.",
    group="Grasping",
)
def reach(scene: Scene, arguments: Arguments) -> None:
    """Move an arm so that palm, wrist or a digit's pad reaches the near side of an object, or a point (R90)."""
    from warpjld.script.reaching import Goal, nearest_side, reach_for

    first, last = read_frames(arguments, "at which the arm begins to move", "at which the hand is there")
    side = read_side(scene, arguments)
    prop = None
    if arguments.keyword("AT"):
        place = np.array(arguments.vector("the point's"))
        name = f"({place[0]:g}, {place[1]:g}, {place[2]:g})"
    else:
        prop = read_object(scene, arguments)
        name = prop.name
    where = arguments.last
    options = arguments.options(**{"with": lambda: arguments.choice("the part of the hand", _PARTS).lower()})
    part = cast(str, options.get("with", "palm"))
    actor = scene.actor_with(side)
    if f"{side}.shoulder" not in actor.skeleton.names:
        raise arguments.error(
            f"actor {actor.name} is a hand without an arm: REACH is for bodies; GRASP or MOVE brings it there", where
        )
    look = None
    if prop is not None:
        place, look = nearest_side(scene, actor, side, prop, last)
    goal = Goal(name, "" if prop is None else prop.name, place, look if part == "palm" else None, part)
    scene.attempts.append(reach_for(scene, actor, side, first, last, goal))
