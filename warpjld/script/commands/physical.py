"""Commands that make objects and flesh deformable, and set friction, bonds and gravity (B §3, R92, R101, R109)."""

from __future__ import annotations

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
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.script.props import Prop

_LAWS = tuple(law.upper() for law in LAWS)


@command(
    "PHYSICAL",
    syntax=(
        f"PHYSICAL <object> [OF <material>] [LAW <{'/'.join(_LAWS)}>] [YOUNG <pascals>] [POISSON <ratio>] "
        "[DENSITY <kg/m³>] [HOLLOW <wall in metres>] [PRESSURE <pascals>] [ELEMENT <metres>]"
    ),
    help="Make an object deformable: OF a material, or by law and moduli; HOLLOW with a wall; ELEMENT: mesh size.",
    group="Contact",
)
def physical(scene: Scene, arguments: Arguments) -> None:
    """Make an object deformable (R92, R109, R111)."""
    prop = read_object(scene, arguments)
    where = arguments.last
    if prop.deforms:
        raise arguments.error(f"{prop.name} is deformed by key frames or by formula: it cannot be physical as well")
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
        scene.contact.physical[prop.name] = ObjectMaterial(**options, where=place(arguments))  # type: ignore[arg-type]
    except InputError as error:
        raise arguments.error(error.message, where) from None


@command(
    "FLESH",
    syntax=(
        "FLESH <actor> [THUMB/INDEX/MIDDLE/RING/PINKY/PALM …] [ELEMENT <metres>] [YOUNG <pascals>] [SKIN <pascals>] "
        "[POISSON <ratio>] [STIFFENING <exponent>] [ITSELF <ON/OFF>]"
    ),
    help="Make an actor's flesh deformable, all of it or the digits and palm named; ITSELF: contact of skin with skin.",
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
    options = arguments.options(
        *DIGIT_WORDS,
        "PALM",
        element=lambda: arguments.number("the elements' size in metres", above=0.0),
        young=lambda: arguments.number("the flesh's modulus in Pa", above=0.0),
        skin=lambda: arguments.number("the skin's modulus in Pa", above=0.0),
        poisson=lambda: arguments.number("Poisson's ratio", minimum=0.3, maximum=0.49),
        stiffening=lambda: arguments.number("the exponent of Fung's law", minimum=0.0, maximum=100.0),
        itself=lambda: arguments.choice("ON or OFF", ("ON", "OFF")) == "ON",
    )
    if "young" in options:
        options["flesh"] = options.pop("young")
    named = tuple(dict.fromkeys(digits))
    scene.contact.flesh[actor.name] = FleshMaterial(named, **options, where=place(arguments))  # type: ignore[arg-type]


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
