"""Grid mesh fitted to a surface, with elements as large as asked, or as its thin parts let them be (R104)."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.errors import InputError
from warpjld.fem import HexMesh
from warpjld.fem.mesh.embedding import Embedding, embed
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.fit import fit_mesh
from warpjld.grasp.objects import GraspObject

__all__ = ["FittedObject", "fitted_object"]

_FINER = 0.8
"""Ratio of successive element sizes."""
_FINEST = 0.25
"""Smallest element size that is tried, per size asked for: elements are then up to 64 times as many."""
_MANY = 30000
"""Most elements of a mesh that is finer than asked for: more would take minutes a step of contact, unasked."""
_LESS = 0.9
"""Share of the surface's volume below which the mesh is said to be thinner than the object."""


@dataclass(frozen=True, eq=False)
class FittedObject:
    """A mesh of the inside of a surface.

    Attributes:
        mesh: Elements up to the surface; its boundary is the face set ``surface``.
        visible: Embedding of the surface's vertices in it.
        heavier: The surface's volume per volume of the mesh, by which a density is multiplied for the object to weigh
            what it does; 1 where the surface is open.
        notes: What differs from what was asked for.
    """

    mesh: HexMesh
    visible: Embedding
    heavier: float
    notes: tuple[str, ...]


def fitted_object(thing: GraspObject, size: float, reach: float) -> FittedObject:
    """Mesh the inside of an object's surface with the largest elements, up to a size, that leave out none of its parts.

    A wall thinner than an element (of a cup, a bowl) is left out of a grid, or folds where it is squeezed into it: then
    elements are made smaller, step by step, and a note tells the size.

    Args:
        thing: Its surface.
        size: Edge length of elements asked for [m].
        reach: Largest distance of the surface's vertices from the mesh, in elements.

    Raises:
        InputError: No size tried serves.
    """
    envelope = Envelope(thing.vertices, thing.faces)
    first: InputError | None = None
    now = size
    while now >= _FINEST * size:
        try:
            fit = fit_mesh(envelope, now)
            visible = embed(fit.mesh, thing.vertices, reach=reach)
        except InputError as error:
            first = first or error
            now *= _FINER
            continue
        if now < size and len(fit.mesh.elements) > _MANY:
            break
        notes = []
        if now < size:
            notes += [f"elements of {size:.3g} m would leave out thin parts: they are {now:.2g} m"]
        if envelope.watertight and fit.volume < _LESS:
            notes += [
                f"the mesh has {fit.volume:.0%} of the object's volume: its density is raised to keep the weight; "
                "smaller elements follow thin parts more closely"
            ]
        return FittedObject(fit.mesh, visible, 1.0 / fit.volume if envelope.watertight else 1.0, tuple(notes))
    text = "" if first is None else first.message
    raise InputError(f"elements of {size:g} m are too large, thin parts are left out ({text}): take smaller ones")
