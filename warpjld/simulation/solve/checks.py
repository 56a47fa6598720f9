"""What cannot work, found before it is tried, and why something did not, found afterwards."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import HexMesh
from warpjld.fem.contact.interface.surface import surface_of
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.bodies.flesh_body import HandBody
from warpjld.simulation.specification import placed
from warpjld.simulation.specification import ContactWishes

__all__ = ["refuse_hopeless", "why_not"]

_APART = 0.3
"""Gap, in elements, that a bond still bridges."""

_DEEP = 5e-4
"""Depth of a bone in a rigid object that the flesh between cannot bear [m]."""

_ON = 2e-4
"""Gap from which on an object stands on what is below it [m]."""


def refuse_hopeless(bodies: Bodies, wishes: ContactWishes) -> None:
    """Refuse bonds between bodies that do not meet, objects inside flesh, lifting what stands on something else, and
    skin that begins deeper in something than contact looks (R112).

    Raises:
        InputError: Names the command's line.
    """
    surfaces = {one.name: _surface(one.volume.mesh, one.volume.name) for one in bodies.objects}
    for bonded in wishes.bonds:
        one, other = surfaces[bonded.one], surfaces[bonded.other]
        gap = float(other.project(one.vertices).distance.min())
        edge = np.linalg.norm(one.vertices[one.faces[:, 1]] - one.vertices[one.faces[:, 0]], axis=1).mean()
        if gap > _APART * float(edge):
            raise placed(
                InputError(f"a bond to nothing: {bonded.one} and {bonded.other} are {1e3 * gap:.3g} mm apart"),
                bonded.where,
            )
    for wish in wishes.grips:
        if wish.lift and (below := _below(bodies, surfaces, wish.object)):
            raise placed(
                InputError(
                    f"LIFT {wish.object}: it stands on {below}, which bears it however the hand grips: "
                    f"move {below} away, or {wish.object} higher; LIFT has a support of its own"
                ),
                wish.where,
            )
    for hand in bodies.hands:
        flesh = Facets(hand.part.skin, hand.part.hand.surface.faces)
        shapes = {one.name: one.volume.surface for one in bodies.objects}
        shapes |= {name: obstacle.mesh(0.0)[0] for name, obstacle in bodies.obstacles.items()}
        for name, vertices in shapes.items():
            if (flesh.project(np.asarray(vertices)).distance < 0.0).all():
                raise InputError(f"{name} lies inside {hand.name}: nothing can press it out; move it out of the flesh")
        _refuse_deep(bodies, hand, surfaces)


def _refuse_deep(bodies: Bodies, hand: HandBody, surfaces: Mapping[str, Facets]) -> None:
    """Refuse skin that begins deeper in an object than overlap is parted from.

    Raises:
        InputError: Names the digits and what they are in.
    """
    flesh = hand.part.hand
    skin = surface_of(flesh.mesh, flesh.name, hand.name)
    x, most = flesh.mesh.nodes[skin.nodes], skin.reach
    depths = {name: -surface.project(x).distance for name, surface in surfaces.items()}
    depths |= {name: -obstacle.project(x, 0.0).distance for name, obstacle in bodies.obstacles.items()}
    for name, depth in depths.items():
        if depth.max() > most:
            part = hand.parts.part_of[flesh.node_labels[skin.nodes[depth > most]]]
            digits = " and ".join(hand.parts.names[k] for k in np.unique(part))
            where = f"{1e3 * depth.max():.2g} mm inside {name} at frame {bodies.start:g}, where contact begins"
            raise InputError(
                f"{hand.name} {digits}: {where}; with these elements it parts {1e3 * most:.2g} mm at most: begin "
                "farther out, or take a larger ELEMENT"
            )


def _below(bodies: Bodies, surfaces: dict[str, Facets], name: str) -> str:
    """What an object stands on at time 0, or nothing."""
    up = -np.array(bodies.loads.gravity) / np.linalg.norm(bodies.loads.gravity)
    points = surfaces[name].vertices
    found = {other: obstacle.project(points, 0.0) for other, obstacle in bodies.obstacles.items()}
    found |= {other: surface.project(points) for other, surface in surfaces.items() if other != name}
    for other, touching in found.items():
        if ((touching.distance < _ON) & (touching.normal @ up > 0.5)).any():
            return other
    return ""


def why_not(bodies: Bodies, time: float) -> str:
    """What keeps bodies from equilibrium at a time, as far as it shows: bones inside rigid objects; or nothing."""
    worst, found = 0.0, ""
    for hand in bodies.hands:
        known = hand.prescribed(time)
        nodes = known.degrees[::3] // 3
        x = hand.part.hand.mesh.nodes[nodes] + known.values.reshape(-1, 3)
        for name, obstacle in bodies.obstacles.items():
            depth = -float(obstacle.project(x, time).distance.min())
            if depth > max(worst, _DEEP):
                worst, found = (
                    depth,
                    f"bones of {hand.name} are {1e3 * depth:.2g} mm inside {name}, which cannot give way",
                )
    return found


def _surface(mesh: HexMesh, name: str) -> Facets:
    quads = mesh.quads(mesh.face_set(name))
    used, corners = np.unique(quads, return_inverse=True)
    corners = corners.reshape(-1, 4)
    triangles: NDArray[np.int32] = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]).astype(np.int32)
    return Facets(mesh.nodes[used], triangles)
