"""Commands that make objects and flesh deformable, and set friction, bonds and gravity (B §3, R92, R101, R109)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.keys import DIGIT_WORDS
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.materials import MATERIALS
from warpjld.simulation.specification import (
    LAWS,
    BondStrength,
    FleshMaterial,
    ObjectMaterial,
    SourceLocation,
    name_pair,
)
from warpjld.simulation.volume_object import region_names
from warpjld.skeleton.segments import SEGMENT_JOINTS, segment_joints
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.script.props import Prop
    from warpjld.skeleton import Skeleton

_LAWS = tuple(law.upper() for law in LAWS)


@command(
    "PHYSICAL",
    syntax=(
        f"PHYSICAL <object> [REGION <region>] [OF <material>] [LAW <{'/'.join(_LAWS)}>] [YOUNG <pascals>] "
        "[POISSON <ratio>] [DENSITY <kg/m³>] [HOLLOW <wall in metres>] [PRESSURE <pascals>] [ELEMENT <metres>]"
    ),
    help="Make an object, or a REGION of its file, deformable: OF a material, or law and moduli; HOLLOW: with a wall.",
    group="Contact",
)
def physical(scene: Scene, arguments: Arguments) -> None:
    """Make an object deformable (R92, R109, R111)."""
    prop = read_object(scene, arguments)
    where = arguments.last
    if prop.deforms:
        raise arguments.error(f"{prop.name} is deformed by key frames or by formula: it cannot be physical as well")
    region = _region(arguments) if arguments.keyword("REGION") else None
    options = arguments.options(
        of=lambda: arguments.choice("a material", [name.upper() for name in MATERIALS]).lower(),
        law=lambda: arguments.choice("the law", _LAWS).lower(),
        young=lambda: arguments.number("Young's modulus in Pa", above=0.0),
        poisson=lambda: arguments.number("Poisson's ratio", above=-1.0, maximum=0.4999),
        density=lambda: arguments.number("the density in kg/m³", minimum=0.0),
        hollow=lambda: arguments.number("the thickness of the wall in metres", above=0.0),
        pressure=lambda: arguments.number("the pressure in Pa"),
        element=lambda: arguments.number("the elements' size in metres", above=0.0),
    )
    if "of" in options:
        name = str(options.pop("of"))
        matter = MATERIALS[name]
        options = {
            "law": matter.law,
            "young": matter.young,
            "poisson": matter.poisson,
            "density": matter.density,
            "made_of": name,
            **options,
        }
    if "hollow" in options:
        options["wall"] = options.pop("hollow")
    if float(cast(float, options.get("wall", 0.0))) >= 0.5 * prop.thing.size.min():
        raise arguments.error(
            f"a wall must be thinner than half of {prop.name}, {0.5 * prop.thing.size.min():g} m", where
        )
    try:
        material = ObjectMaterial(**options, where=place(arguments))  # type: ignore[arg-type]
    except InputError as error:
        raise arguments.error(error.message, where) from None
    known = scene.contact.physical.get(prop.name)
    if region is not None:
        material = _with_region(arguments, prop, known or ObjectMaterial(where=material.where), region, material)
    elif known is not None:
        material = replace(material, regions=known.regions)
    scene.contact.physical[prop.name] = material


def _region(arguments: Arguments) -> str:
    """Read the name of a region; a number stands for the region of the file that has no other name."""
    if arguments.has_number():
        return f"region{arguments.integer('the number of a region', minimum=0)}"
    return arguments.name("a region's name")


def _with_region(
    arguments: Arguments, prop: Prop, whole: ObjectMaterial, name: str, material: ObjectMaterial
) -> ObjectMaterial:
    """Copy of an object's material with the material of one region of its volume file replaced."""
    known = [region for region in region_names(prop.thing) if region.lower() == name.lower()]
    if not known:
        names = region_names(prop.thing)
        more = did_you_mean(name, names) or (f"; it has {', '.join(names)}" if names else ": it is from no volume file")
        raise arguments.error(f"{prop.name} has no region {name}{more}")
    if material.wall or material.pressure or material.element is not None:
        raise arguments.error("HOLLOW, PRESSURE and ELEMENT are for an object as a whole, not for a region")
    others = tuple(one for one in whole.regions if one[0] != known[0])
    return replace(whole, regions=(*others, (known[0], material)))


@command(
    "FLESH",
    syntax=(
        "FLESH <actor> [THUMB/INDEX/MIDDLE/RING/PINKY/PALM … or <segment> …] [ELEMENT <metres>] [YOUNG <pascals>] "
        "[SKIN <pascals>] [POISSON <ratio>] [STIFFENING <exponent>] [ITSELF <ON/OFF>] [FLEXION] "
        '[BONES "<surface file>"]'
    ),
    help="Make an actor's flesh deformable: all, or the digits, palm and segments named; FLEXION: by bending too.",
    group="Contact",
)
def flesh(scene: Scene, arguments: Arguments) -> None:
    """Make an actor's flesh deformable, all of it or the digits and palm named (R91, R105, R126)."""
    name = arguments.name("an actor's name")
    try:
        actor = scene.actor(name)
    except InputError as error:
        raise arguments.error(error.message) from None
    digits = []
    while (digit := arguments.keyword(*DIGIT_WORDS, "PALM")) is not None:
        digits.append(digit.lower())
    segments = _segments(arguments, actor.skeleton) if not digits else []
    options = arguments.options(
        *DIGIT_WORDS,
        "PALM",
        element=lambda: arguments.number("the elements' size in metres", above=0.0),
        young=lambda: arguments.number("the flesh's modulus in Pa", above=0.0),
        skin=lambda: arguments.number("the skin's modulus in Pa", above=0.0),
        poisson=lambda: arguments.number("Poisson's ratio", minimum=0.3, maximum=0.49),
        stiffening=lambda: arguments.number("the exponent of Fung's law", minimum=0.0, maximum=100.0),
        itself=lambda: arguments.choice("ON or OFF", ("ON", "OFF")) == "ON",
        flexion=lambda: True,
        bones=lambda: arguments.input_file("a file of bones"),
    )
    if "young" in options:
        options["flesh"] = options.pop("young")
    named, parts = tuple(dict.fromkeys(digits)), tuple(dict.fromkeys(segments))
    material = FleshMaterial(named, parts, **options, where=place(arguments))  # type: ignore[arg-type]
    scene.contact.flesh[actor.name] = material


def _segments(arguments: Arguments, skeleton: Skeleton) -> list[str]:
    """Consume the segment names that come next: words ``side.name`` or anatomical names that are not options."""
    out = []
    while (word := arguments.next_word()) is not None and ("." in word or word.lower() in SEGMENT_JOINTS):
        name = arguments.name("a segment's name").lower()
        try:
            segment_joints(skeleton, name)
        except InputError as error:
            raise arguments.error(error.message) from None
        out.append(name)
    return out


@command(
    "FRICTION",
    syntax="FRICTION <actor or object> <actor or object> <coefficient> or FRICTION <coefficient>",
    help="Coulomb coefficient of friction between two bodies, or the default for all pairs; 0.6 unless set.",
    group="Contact",
)
def friction(scene: Scene, arguments: Arguments) -> None:
    """Coulomb coefficient of friction between two bodies, or the default for all pairs; 0.6 unless set (R122)."""
    if arguments.has_number():
        scene.contact.everywhere = _coefficient(arguments)
        return
    first, second = _body(scene, arguments), _body(scene, arguments)
    scene.contact.friction[name_pair(first, second)] = _coefficient(arguments)


@command(
    "BOND",
    syntax="BOND <object> <object> <tension in pascals> [<shear in pascals>]",
    help="Bond two physical objects where they touch; the bond breaks where tension or shear exceeds these.",
    group="Contact",
)
def bond(scene: Scene, arguments: Arguments) -> None:
    """Bond two physical objects where they touch, until tension or shear exceeds a limit (R101, R102)."""
    names = []
    for _ in range(2):
        prop = read_object(scene, arguments)
        if prop.name not in scene.contact.physical:
            raise arguments.error(f"{prop.name} is not physical: a bond needs two objects made so with PHYSICAL")
        names.append(prop.name)
    if names[0] == names[1]:
        raise arguments.error(f"{names[0]} cannot be bonded to itself")
    normal = arguments.number("the tension in Pa at which they part", above=0.0)
    shear = arguments.number("the shear in Pa at which they part", above=0.0) if arguments else normal
    scene.contact.bonds.append(BondStrength(names[0], names[1], normal, shear, place(arguments)))


@command(
    "GRAVITY",
    syntax="GRAVITY <x> <y> <z>",
    help="Acceleration of gravity on physical objects and flesh [m/s²]; 0 0 0 by default.",
    group="Contact",
)
def gravity(scene: Scene, arguments: Arguments) -> None:
    """Acceleration of gravity on physical objects and flesh [m/s²]; 0 0 0 by default (R97)."""
    scene.contact.gravity = arguments.vector("the acceleration's")


def read_object(scene: Scene, arguments: Arguments) -> Prop:
    """Read the name of an object; the object."""
    name = arguments.name("an object's name")
    try:
        return scene.prop(name)
    except InputError as error:
        raise arguments.error(error.message) from None


def place(arguments: Arguments) -> SourceLocation:
    """Position of the command in the script: path, line, column."""
    return arguments.position.path, arguments.position.line, arguments.position.column


def _body(scene: Scene, arguments: Arguments) -> str:
    name = arguments.name("an actor's or an object's name").upper()
    known = [*scene.actors, *scene.props]
    if name not in known:
        raise arguments.error(f"there is no actor or object {name}{did_you_mean(name, known)}")
    return name


def _coefficient(arguments: Arguments) -> float:
    return arguments.number("the coefficient of friction", minimum=0.0, maximum=10.0)
