"""Commands for the covering: parameters, method, domains, contact for display (A §3, R22, R23)."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Literal

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.keys import SIDES, read_joint
from warpjld.script.registry import command
from warpjld.script.scene import Scene


@command(
    "PARAMETER",
    syntax=("PARAMETER [LEFT/RIGHT] <joint or ALL> <INFLATION/PROXIMITY/MUSCLE/PEAK/EXPONENTS/PALM> <value> [<value>]"),
    help="Set a parameter of a joint; PROXIMITY and EXPONENTS take two values.",
    group="Covering",
)
def parameter(scene: Scene, arguments: Arguments) -> None:
    """Set a parameter of a joint; PROXIMITY and EXPONENTS take two values (R22, R65)."""
    side = arguments.keyword(*SIDES)
    if arguments.keyword("ALL"):
        actor = scene.actor_with(side) if side else scene.actor()
        joints = list(range(len(actor.skeleton)))
    else:
        actor, joint = read_joint(scene, arguments, side)
        joints = [joint]
    field = arguments.choice("the parameter", [f.name.upper() for f in fields(actor.parameters)]).lower()
    where = arguments.last
    array = getattr(actor.parameters, field).copy()
    wanted = 1 if array.ndim == 1 else array.shape[1]
    values = [arguments.number(f"value {k + 1} of {wanted} for {field.upper()}", minimum=0) for k in range(wanted)]
    array[joints] = values[0] if array.ndim == 1 else values
    changed = replace(actor.parameters, **{field: array})
    try:
        changed.check(actor.skeleton)
    except InputError as error:
        raise arguments.error(error.message, where) from None
    actor.parameters = changed


@command(
    "PARAMETERS",
    syntax='PARAMETERS "<parameter file>"',
    help="Read all parameters of the current actor from a file that warpjld calibrate wrote.",
    group="Covering",
)
def parameters(scene: Scene, arguments: Arguments) -> None:
    """Read all parameters of the current actor from a file that ``warpjld calibrate`` wrote (R23)."""
    from warpjld.covering.parameters import load_parameters

    actor = scene.actor()
    path = arguments.input_file("a parameter file")
    actor.parameters = load_parameters(path, actor.skeleton)


@command(
    "METHOD",
    syntax="METHOD <SMOOTH/PAPER>",
    help="Method of the current actor's covering: smooth domain borders, or the paper's one segment per vertex.",
    group="Covering",
)
def method(scene: Scene, arguments: Arguments) -> None:
    """Method of the current actor's covering: smooth domain borders, or the paper's one segment per vertex (R16)."""
    actor = scene.actor()
    chosen = arguments.choice("the method", ("SMOOTH", "PAPER"))
    actor.method = "paper" if chosen == "PAPER" else "smooth"


@command(
    "DOMAINS",
    syntax="DOMAINS <GEOMETRY/SKIN>",
    help="Source of the current actor's domains: the surface's geometry, or the rig's painted weights.",
    group="Covering",
)
def domains(scene: Scene, arguments: Arguments) -> None:
    """Source of the current actor's domains: the surface's geometry, or the rig's painted weights (R16)."""
    actor = scene.actor()
    chosen = arguments.choice("the source of domains", ("GEOMETRY", "SKIN"))
    if chosen == "SKIN" and actor.rig.skin is None:
        raise arguments.error(f"actor {actor.name} has no painted weights; use DOMAINS GEOMETRY")
    actor.domains = "skin" if chosen == "SKIN" else "geometry"


@command(
    "TOUCH",
    syntax="TOUCH <ON/OFF/LIMIT>",
    help=(
        "Push skin out of other skin and objects, for display only (PRESS solves contact); "
        "LIMIT: digits also stop where they touch."
    ),
    group="Covering",
)
def touch(scene: Scene, arguments: Arguments) -> None:
    """Contact of the skin for display, without finite elements."""
    words: dict[str, Literal["on", "off", "limit"]] = {"ON": "on", "OFF": "off", "LIMIT": "limit"}
    scene.actor().touch = words[arguments.choice("whether skin is parted", tuple(words))]
