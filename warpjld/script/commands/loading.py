"""Commands for loads on objects: forces, tractions, pressures, centrifugal forces, prestress (B eqs. 1–4, R97)."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Literal, cast

from warpjld.motion import Key, Track
from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import place, read_object
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.object_loads import ObjectLoad, ObjectSpin
from warpjld.suggest import did_you_mean

_KEYS = "<key1> <key2> <step>"


@command(
    "FORCE",
    syntax=f"FORCE <object> <points> {_KEYS} <x> <y> <z>",
    help="Total force on a set of object points at key1, key1 + step, … up to key2 [N].",
    group="Contact",
)
def force(scene: Scene, arguments: Arguments) -> None:
    """Total force on a set of object points [N] (R97)."""
    _read(scene, arguments, "force", "xyz")


@command(
    "TRACTION",
    syntax=f"TRACTION <object> <points> {_KEYS} <x> <y> <z>",
    help="Traction on the faces between object points, in a constant direction [Pa].",
    group="Contact",
)
def traction(scene: Scene, arguments: Arguments) -> None:
    """Traction on the faces between object points, in a constant direction [Pa] (R97)."""
    _read(scene, arguments, "traction", "xyz")


@command(
    "PRESSURE",
    syntax=f"PRESSURE <object> <points> {_KEYS} <pascals>",
    help="Pressure on the faces between object points, along their deformed normals [Pa].",
    group="Contact",
)
def pressure(scene: Scene, arguments: Arguments) -> None:
    """Pressure on the faces between object points, along their deformed normals [Pa] (R97)."""
    _read(scene, arguments, "pressure", ("pressure",))


@command(
    "SPIN",
    syntax=f"SPIN <object> <X/Y/Z> {_KEYS} <turns a second> [AT <x> <y> <z>]",
    help="Centrifugal force of a steady rotation about a world axis through the object's centre, or through AT.",
    group="Contact",
)
def spin(scene: Scene, arguments: Arguments) -> None:
    """Centrifugal force of a steady rotation about a world axis (R97)."""
    prop = read_object(scene, arguments)
    _want_physical(scene, arguments, prop.name)
    if prop.name in scene.contact.spins:
        raise arguments.error(f"{prop.name} turns about an axis already")
    axis = ["X", "Y", "Z"].index(arguments.choice("the axis", ("X", "Y", "Z")))
    keys, value = arguments.keys_and_value("the turns a second")
    options = arguments.options(at=lambda: arguments.vector("the place's"))
    thing = prop.thing
    middle = thing.place.apply(0.5 * (thing.vertices.min(axis=0) + thing.vertices.max(axis=0))[None])[0, 0]
    x, y, z = cast("tuple[float, float, float]", options.get("at", tuple(middle.tolist())))
    track = Track("spin")
    for key in keys:
        track.set(Key(key, 2.0 * math.pi * value, **asdict(scene.spline)))
    way = (float(axis == 0), float(axis == 1), float(axis == 2))
    scene.contact.spins[prop.name] = ObjectSpin(way, (float(x), float(y), float(z)), track, place(arguments))


@command(
    "PRESTRESS",
    syntax="PRESTRESS <object> <xx> <yy> <zz> [<xy> <yz> <zx>]",
    help="Initial stress of an object in its own axes [Pa], tension positive; it relaxes where the object is not held.",
    group="Contact",
)
def prestress(scene: Scene, arguments: Arguments) -> None:
    """Initial stress of an object in its own axes [Pa] (R98)."""
    prop = read_object(scene, arguments)
    _want_physical(scene, arguments, prop.name)
    values = [arguments.number(f"the stress {name} in Pa") for name in ("xx", "yy", "zz")]
    if arguments:
        values += [arguments.number(f"the stress {name} in Pa") for name in ("xy", "yz", "zx")]
    matter = scene.contact.physical[prop.name]
    scene.contact.physical[prop.name] = replace(matter, prestress=tuple([*values, 0.0, 0.0, 0.0][:6]))


def _read(
    scene: Scene, arguments: Arguments, kind: Literal["force", "traction", "pressure"], channels: str | tuple[str, ...]
) -> None:
    """Read an object, the name of its points, keys and a value for each channel; set the load's keys."""
    prop = read_object(scene, arguments)
    _want_physical(scene, arguments, prop.name)
    name = arguments.name("the name of points").upper()
    known = [points for owner, points in scene.contact.points if owner == prop.name]
    if name not in known:
        more = did_you_mean(name, known) or f"; name them with POINTS {prop.name} {name} …"
        raise arguments.error(f"{prop.name} has no points {name}{more}")
    first = channels[0]
    keys, value = arguments.keys_and_value(f"the {kind}{'' if first == kind else f' along {first}'}")
    values = [value, *(arguments.number(f"the {kind} along {channel}") for channel in channels[1:])]
    load = scene.contact.loads.setdefault(
        (prop.name, name, kind), ObjectLoad(kind, scene.contact.points[prop.name, name])
    )
    for channel, number in zip(channels, values, strict=True):
        track = load.tracks.setdefault(channel, Track(channel))
        for key in keys:
            track.set(Key(key, number, **asdict(scene.spline)))


def _want_physical(scene: Scene, arguments: Arguments, name: str) -> None:
    if name not in scene.contact.physical:
        raise arguments.error(f"{name} is not physical: make it so with PHYSICAL {name}")
