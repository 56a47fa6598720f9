"""Command PIECES: cuts an object into pieces connected by bonds (B §3.2, R101, R102, R141)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from warpjld.errors import InputError
from warpjld.script.arguments import Arguments
from warpjld.script.commands.physical import place, read_object
from warpjld.script.registry import command
from warpjld.script.scene import Scene
from warpjld.simulation.specification import BondStrength, name_pair

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject
    from warpjld.script.props import Prop

_AXES = ("X", "Y", "Z")
_MOST = 100
"""Largest number of pieces."""
_NEAR = 1e-6
"""Largest distance between vertices of two pieces that counts as shared, over the largest piece's size."""


@command(
    "PIECES",
    syntax="PIECES <object> <count> [ALONG <X/Y/Z>] [BOND <tension in pascals> [<shear>]] or PIECES <object> REGIONS "
    "[BOND …]",
    help="Cut an object into bonded pieces <object>_1, … across its longest axis, or by regions of its volume file.",
    group="Contact",
)
def pieces(scene: Scene, arguments: Arguments) -> None:
    """Cut an object into bonded pieces, each an object that can have its own constitutive law (R101, R141)."""
    from warpjld.grasp.pieces import cut_object, longest_axis
    from warpjld.simulation.volume_object import pieces_by_region

    prop = read_object(scene, arguments)
    where = arguments.last
    if prop.deforms:
        raise arguments.error(f"{prop.name} is deformed by key frames or by formula: it cannot be cut")
    if prop.placement.tracks or prop.associations or _is_named(scene, prop.name):
        raise arguments.error(f"{prop.name} is moved, bonded or held already: cut it first, then move its pieces")
    physical = scene.contact.physical.get(prop.name)
    if physical is not None and physical.wall > 0.0:
        raise arguments.error(
            f"{prop.name} is HOLLOW, and a wall across the cut would close each piece: cut it as a solid, then make "
            f"pieces HOLLOW (PHYSICAL {prop.name}_1 … HOLLOW) if such walls are meant",
            where,
        )
    regions = arguments.keyword("REGIONS") is not None
    count = 0 if regions else arguments.integer("the number of pieces", minimum=2, maximum=_MOST)
    options = arguments.options(
        along=lambda: _AXES.index(arguments.choice("the axis", _AXES)),
        bond=lambda: _strength(arguments),
    )
    try:
        if regions:
            if "along" in options:
                raise InputError("ALONG is for a number of pieces: regions are as the file has them")
            cut = pieces_by_region(prop.thing)
        else:
            cut = cut_object(prop.thing, count, cast(int, options.get("along", longest_axis(prop.thing))))
    except InputError as error:
        raise arguments.error(error.message, where) from None
    made = _replaced(scene, prop, cut, arguments)
    normal, shear = cast(tuple[float, float], options.get("bond", (np.inf, np.inf)))
    _share_friction(scene, prop.name, made)
    for one, other in _neighbours(cut):
        scene.contact.bonds.append(BondStrength(made[one], made[other], normal, shear, place(arguments)))


def _strength(arguments: Arguments) -> tuple[float, float]:
    """Tensile and shear strength of the bonds [Pa]; shear defaults to the tension."""
    normal = arguments.number("the tension in Pa at which they part", above=0.0)
    return normal, arguments.number(
        "the shear in Pa at which they part", above=0.0
    ) if arguments.has_number() else normal


def _is_named(scene: Scene, name: str) -> bool:
    """Whether the contact specification has bonds, loads or prescribed points of an object."""
    contact = scene.contact
    bonded = any(name in (bond.one, bond.other) for bond in contact.bonds)
    return bonded or name in contact.loaded or any(name == owner for owner, _ in contact.points)


def _share_friction(scene: Scene, name: str, pieces: list[str]) -> None:
    """Give the pieces the coefficients of friction that were set for the whole."""
    pairs = scene.contact.friction
    for pair in [pair for pair in pairs if name in pair]:
        coefficient = pairs.pop(pair)
        other = pair[1] if pair[0] == name else pair[0]
        others = pieces if other == name else [other]
        pairs.update({name_pair(piece, one): coefficient for piece in pieces for one in others})


def _replaced(scene: Scene, prop: Prop, cut: list[GraspObject], arguments: Arguments) -> list[str]:
    """Replace an object in the scene by its pieces; returns their names."""
    from warpjld.script.props import COLORS
    from warpjld.script.props import Prop as Piece

    names = [thing.name.upper() for thing in cut]
    if taken := [name for name in names if name in scene.props or name in scene.actors]:
        raise arguments.error(f"there is an object or actor {taken[0]} already")
    props = dict(scene.props)
    del scene.props[prop.name]
    physical = scene.contact.physical.pop(prop.name, None)
    first = list(props).index(prop.name)
    for k, (name, thing) in enumerate(zip(names, cut, strict=True)):
        color = prop.color if k == 0 else COLORS[(first + k) % len(COLORS)]
        scene.props[name] = Piece(name, thing, color, assumed=prop.assumed)
        if physical is not None:
            scene.contact.physical[name] = replace(physical, regions=())
    return names


def _neighbours(cut: list[GraspObject]) -> list[tuple[int, int]]:
    """Pairs of pieces whose surfaces share three vertices or more."""
    from scipy.spatial import cKDTree

    size = max(float(thing.size.max()) for thing in cut)
    trees = [cKDTree(thing.vertices) for thing in cut]
    return [
        (a, b)
        for a in range(len(cut))
        for b in range(a + 1, len(cut))
        if trees[a].count_neighbors(trees[b], _NEAR * size) >= 3
    ]
