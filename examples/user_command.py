"""A user-defined command in a few lines of Python: GRIP bends all fingers of a hand to a percentage of a fist.

    warpjld run examples/user_command.jld --commands examples/user_command.py

An installed package adds its commands without ``--commands`` by an entry point in the group ``warpjld.commands``.
"""

import warpjld as wj

FIST = {"base": 84, "knuckle2": 98, "knuckle3": 70}
"""Flexion of a finger's joints in a closed fist [degrees]."""


@wj.command(
    "GRIP",
    syntax="GRIP <LEFT/RIGHT> <key> <percent>",
    help="Bend all fingers by a share of a fist, the pinky most.",
    group="Examples",
)
def grip(scene: wj.Scene, arguments: wj.Arguments) -> None:
    """Sets one key on twelve joints."""
    side = arguments.choice("the side", ("LEFT", "RIGHT")).lower()
    key = arguments.number("the key")
    share = arguments.number("the percentage", minimum=0, maximum=100) / 100
    for finger, more in (("index", 0.94), ("middle", 0.97), ("ring", 0.98), ("pinky", 1.0)):
        for joint, degrees in FIST.items():
            line = f"JOINT {side}.{finger}.{joint} FLEXION AT {key} {degrees * more * share}"
            arguments.interpreter.run_text(line, "<GRIP>")
