"""Validation of specification and model before anything is solved."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.contact.interface.surface import surface_of
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.animation import Animation
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.surface_offset import outer_surface
from warpjld.simulation.solve.bone_clearance import BoneClearance
from warpjld.simulation.specification import (
    BondStrength,
    ContactSpecification,
    GripSpecification,
    SolveSpecification,
    located,
)

__all__ = ["check_model", "check_specification"]

_APART = 0.3
"""Largest gap across which two objects can be bonded, in element edges."""

_ON = 2e-4
"""Gap below which an object counts as standing on what is below it [m]."""


def check_specification(animation: Animation, contact: ContactSpecification, request: SolveSpecification) -> None:
    """Reject unknown names and impossible grips and corrections, before anything is meshed.

    Raises:
        InputError: With the command's line, if there is one.
    """
    contact.check()
    for kind, names, known in (
        ("actor", contact.flesh, animation.actors),
        ("object", contact.physical, animation.objects),
    ):
        if unknown := [name for name in names if name not in known]:
            raise InputError(f"there is no {kind} {unknown[0]}; there are {', '.join(known) or 'none'}")
    begun = set()
    for grip in contact.grips:
        try:
            _check_grip(contact, grip, request)
            if not animation.actors[grip.actor].bendable:
                raise InputError(f"actor {grip.actor} is driven by recorded poses: a grip search needs joint angles")
            if grip.first in begun:
                raise InputError(f"another grip begins at frame {grip.first:g}")
        except InputError as error:
            raise located(error, grip.where) from None
        begun.add(grip.first)
    if request.correct and request.method == "paper":
        raise InputError("CORRECT goes on from the frame before: the paper's method cannot")
    recorded = [name for name in contact.flesh if not animation.actors[name].bendable]
    if request.correct and recorded:
        raise InputError(f"actor {recorded[0]} is driven by recorded poses: there are no joint angles to correct")


def _check_grip(contact: ContactSpecification, grip: GripSpecification, request: SolveSpecification) -> None:
    if grip.actor not in contact.flesh:
        raise InputError(f"{grip.actor} has no flesh that deforms: FLESH {grip.actor} makes it so")
    if grip.first <= request.first or grip.last > request.last:
        span = f"after {request.first} and up to {request.last}"
        raise InputError(f"its frames must lie in those of PRESS, {span}, got {grip.first:g} to {grip.last:g}")
    if request.method == "paper":
        raise InputError("a grip cannot be searched for by the paper's method, which knows no friction")
    _check_share(grip)
    if not grip.lift:
        return
    if np.count_nonzero(contact.pull) != 1:
        x, y, z = contact.pull
        raise InputError(f"LIFT wants a GRAVITY along one axis of the stage, got {x:g} {y:g} {z:g}")
    bonded = next((b for b in contact.bonds if grip.object in (b.one, b.other)), None)
    if bonded is not None:
        other = bonded.other if bonded.one == grip.object else bonded.one
        raise InputError(f"LIFT takes the weight of one object, and {grip.object} is bonded to {other}")
    if any(state.tracks for (name, _), state in contact.prescribed.items() if name == grip.object):
        raise InputError("LIFT wants an object that nothing but HOLD keeps in its place: no VECTOR and no PARTIAL")
    if grip.weight is None and not contact.physical[grip.object].density > 0.0:
        raise InputError(f"{grip.object} weighs nothing: give it a DENSITY, or LIFT it with a WEIGHT")


def _check_share(grip: GripSpecification) -> None:
    if not grip.lift and grip.force is None:
        raise InputError("a grip needs a force, or lift=True")
    if grip.share is None:
        return
    if grip.share != "muscles" or grip.lift:
        raise InputError(f"share: want 'muscles', of the force of a grip that does not lift, got {grip.share!r}")
    closing = {channel.split(".")[-3] for channel in grip.channels}
    if stray := [digit for digit in grip.digits if digit not in closing]:
        raise InputError(f"digits: {stray[0]} does not close here; {', '.join(sorted(closing)) or 'none'} do")


def check_model(model: ContactModel, contact: ContactSpecification) -> None:
    """Reject bonds across a gap, objects inside flesh, lifted objects that stand on others, initial overlaps deeper
    than the search distance of contact, and actors whose bones begin in each other (R112).

    Raises:
        InputError: With the command's line, if there is one.
    """
    surfaces = {one.name: outer_surface(one.mesh, one.faces) for one in model.objects}
    for bonded in contact.bonds:
        _refuse_apart(surfaces, bonded)
    for grip in contact.grips:
        if grip.lift and (below := _below(model, surfaces, grip.object)):
            raise located(
                InputError(
                    f"LIFT {grip.object}: it stands on {below}, which bears it however the hand grips: "
                    f"move {below} away, or {grip.object} higher; LIFT has a support of its own"
                ),
                grip.where,
            )
    for hand in model.hands:
        flesh = Facets(hand.surface, hand.triangles)
        shapes = {one.name: one.surface for one in model.objects}
        shapes |= {name: obstacle.mesh(0.0)[0] for name, obstacle in model.obstacles.items()}
        for name, vertices in shapes.items():
            if (flesh.project(np.asarray(vertices)).distance < 0.0).all():
                raise InputError(f"{name} lies inside {hand.name}: nothing can press it out; move it out of the flesh")
        _refuse_deep(model, hand, surfaces)
    _refuse_crossed(model)


def _refuse_apart(surfaces: Mapping[str, Facets], bonded: BondStrength) -> None:
    """Reject a bond between objects that are apart.

    Raises:
        InputError: With the command's line, if there is one.
    """
    one, other = surfaces[bonded.one], surfaces[bonded.other]
    gap = float(other.project(one.vertices).distance.min())
    edge = np.linalg.norm(one.vertices[one.faces[:, 1]] - one.vertices[one.faces[:, 0]], axis=1).mean()
    if gap > _APART * float(edge):
        text = f"a bond to nothing: {bonded.one} and {bonded.other} are {1e3 * gap:.3g} mm apart"
        raise located(InputError(text), bonded.where)


def _refuse_deep(model: ContactModel, hand: FleshBody, surfaces: Mapping[str, Facets]) -> None:
    """Reject initial overlaps of skin that are deeper than contact can remove.

    Raises:
        InputError: Names the digits and the object.
    """
    skin = surface_of(hand.mesh, hand.faces, hand.name)
    x, most = hand.mesh.nodes[skin.nodes], skin.reach
    depths = {name: -surface.project(x).distance for name, surface in surfaces.items()}
    depths |= {name: -obstacle.project(x, 0.0).distance for name, obstacle in model.obstacles.items()}
    for name, depth in depths.items():
        if depth.max() > most:
            part = hand.parts.part_of[hand.hand.node_labels[skin.nodes[depth > most]]]
            digits = " and ".join(hand.parts.names[k] for k in np.unique(part))
            where = f"{1e3 * depth.max():.2g} mm inside {name} at frame {model.start:g}, where contact begins"
            raise InputError(
                f"{hand.name} {digits}: {where}; with these elements it parts {1e3 * most:.2g} mm at most: begin "
                "farther out, or take a larger ELEMENT"
            )


def _refuse_crossed(model: ContactModel) -> None:
    """Reject actors that begin so deep in each other that a bone of one lies in the other's bones: no flesh is left
    between them that could give way.

    Raises:
        InputError: Names the digit and both actors.
    """
    found = BoneClearance(model).between_actors(model, 0.0) if len(model.hands) > 1 else []
    worst = min(found, key=lambda bone: bone.left, default=None)
    if worst is not None and worst.left <= 0.0:
        raise InputError(
            f"{worst.text}: they pass through each other at frame {model.start:g}, where contact begins; begin farther "
            "apart"
        )


def _below(model: ContactModel, surfaces: dict[str, Facets], name: str) -> str:
    """Name of the body an object stands on at time 0; empty if there is none."""
    up = -np.array(model.loads.gravity) / np.linalg.norm(model.loads.gravity)
    points = surfaces[name].vertices
    found = {other: obstacle.project(points, 0.0) for other, obstacle in model.obstacles.items()}
    found |= {other: surface.project(points) for other, surface in surfaces.items() if other != name}
    for other, touching in found.items():
        if ((touching.distance < _ON) & (touching.normal @ up > 0.5)).any():
            return other
    return ""
