"""Commands for prescribed displacements of object points, and Barr's deformations (B §3.1, §3.4, R94, R128, R129)."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Literal, cast

from warpjld.motion import Key, Track
from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import read_object
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.state_variables import BarrKeys, Points, PrescribedPoints
from warpjld.suggest import did_you_mean

_KEYS = "<key1> <key2> <step>"
_AXES = ("X", "Y", "Z")
_AXIS_SETS = ("X", "Y", "Z", "XY", "XZ", "YZ")


@command(
    "POINTS",
    syntax=(
        "POINTS <object> <name> <UPPER/LOWER> <X/Y/Z> <share> or POINTS <object> <name> NEAR <x> <y> <z> <radius> "
        "or POINTS <object> <name> ALL"
    ),
    help="Name a set of points of a physical object: one end along an axis, those near a world position, or all.",
    group="Contact",
)
def points(scene: Scene, arguments: Arguments) -> None:
    """Name a set of points of a physical object (R128)."""
    prop = read_object(scene, arguments)
    if prop.name not in scene.contact.physical:
        raise arguments.error(f"{prop.name} is not physical: make it so with PHYSICAL {prop.name}")
    name = arguments.name("a name for the points").upper()
    where = arguments.last
    kind = arguments.choice("which points", ("UPPER", "LOWER", "NEAR", "ALL"))
    if kind == "ALL":
        chosen = Points()
    elif kind == "NEAR":
        centre = arguments.vector("the place's")
        chosen = Points("near", centre=centre, radius=arguments.number("the radius in metres", above=0.0))
    else:
        axis = _AXES.index(arguments.choice("the axis", _AXES))
        share = arguments.number("the share of the extent", minimum=0.0, maximum=1.0)
        chosen = Points("upper" if kind == "UPPER" else "lower", axis, share)
    known, contact = (prop.name, name), scene.contact
    used = known in contact.prescribed or any(key[:2] == known for key in contact.loads)
    if used and contact.points[known] != chosen:
        raise arguments.error(f"points {name} of {prop.name} are used above already: take another name", where)
    contact.points[known] = chosen


@command(
    "VECTOR",
    syntax=f"VECTOR <object> <points> {_KEYS} <x> <y> <z>",
    help="Prescribe the displacement of object points at key1, key1 + step, … up to key2 [m]; free before key1.",
    group="Contact",
)
def vector(scene: Scene, arguments: Arguments) -> None:
    """Prescribe the displacement of object points at key1, key1 + step, … up to key2 [m] (R128)."""
    state = _state(scene, arguments)
    keys, first = arguments.keys_and_value("the displacement's x")
    values = (first, arguments.number("the displacement's y"), arguments.number("the displacement's z"))
    for axis, value in zip("xyz", values, strict=True):
        _set(scene, state.tracks, axis, keys, value)


@command(
    "PARTIAL",
    syntax=f"PARTIAL <object> <points> <{'/'.join(_AXIS_SETS)}> {_KEYS} <value> [<value>]",
    help="Prescribe the displacement of object points along one or two axes only [m]; free along the others.",
    group="Contact",
)
def partial(scene: Scene, arguments: Arguments) -> None:
    """Prescribe the displacement of object points along one or two axes only [m]; free along the others (R128)."""
    state = _state(scene, arguments)
    axes = arguments.choice("the axes", _AXIS_SETS).lower()
    keys, value = arguments.keys_and_value(f"the displacement's {axes[0]}")
    _set(scene, state.tracks, axes[0], keys, value)
    for axis in axes[1:]:
        _set(scene, state.tracks, axis, keys, arguments.number(f"the displacement's {axis}"))


@command(
    "HOLD",
    syntax="HOLD <object> <points> [<last frame>]",
    help="Fix object points to the object's placement (MOVE, TURN, OBJECTS); free after the last frame.",
    group="Contact",
)
def hold(scene: Scene, arguments: Arguments) -> None:
    """Fix object points to the object's placement (MOVE, TURN, OBJECTS); free after the last frame (R129)."""
    state = _state(scene, arguments)
    state.held = True
    if arguments:
        state.until = arguments.number("the last frame they are held at")


@command(
    "DEFORM",
    syntax=f"DEFORM <object> <TAPER/TWIST/BEND> <X/Y/Z> {_KEYS} <share or degrees>",
    help="Taper, twist or bend an object along an axis (Barr), by this from end to end; it bends to the next axis.",
    group="Contact",
)
def deform(scene: Scene, arguments: Arguments) -> None:
    """Taper, twist or bend an object along one of its axes by Barr's formulas, by this much from end to end (R94)."""
    prop = read_object(scene, arguments)
    if prop.name in scene.contact.physical:
        raise arguments.error(f"{prop.name} is physical: forces deform it, not formulas")
    if prop.shapes is not None:
        raise arguments.error(f"{prop.name} is deformed by key frames already")
    kind = arguments.choice("the deformation", ("TAPER", "TWIST", "BEND")).lower()
    axis = cast(Literal["x", "y", "z"], arguments.choice("the axis", _AXES).lower())
    if prop.barred is None:
        prop.barred = BarrKeys(axis)
    elif prop.barred.axis != axis:
        raise arguments.error(f"{prop.name} is deformed along {prop.barred.axis.upper()} already: one axis an object")
    keys, value = arguments.keys_and_value("the share" if kind == "taper" else "the angle in degrees")
    if kind == "taper" and not value < 1.0:
        raise arguments.error(f"a taper must be less than 1, got {value:g}")
    _set(scene, prop.barred.tracks, kind, keys, value if kind == "taper" else math.radians(value))


def _state(scene: Scene, arguments: Arguments) -> PrescribedPoints:
    """Read an object and the name of its points; the prescribed displacement of these."""
    prop = read_object(scene, arguments)
    name = arguments.name("the name of points").upper()
    known = [points for owner, points in scene.contact.points if owner == prop.name]
    if name not in known:
        more = did_you_mean(name, known) or f"; name them with POINTS {prop.name} {name} …"
        raise arguments.error(f"{prop.name} has no points {name}{more}")
    chosen = scene.contact.points[prop.name, name]
    return scene.contact.prescribed.setdefault((prop.name, name), PrescribedPoints(chosen))


def _set(scene: Scene, tracks: dict[str, Track], channel: str, keys: list[float], value: float) -> None:
    track = tracks.setdefault(channel, Track(channel))
    for key in keys:
        track.set(Key(key, value, **asdict(scene.spline)))
