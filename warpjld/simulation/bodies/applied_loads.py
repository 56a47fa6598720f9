"""External loads of an object applied to its mesh: nodal forces, face sets and values over time (R97)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import Centrifugal, HexMesh, Loads
from warpjld.simulation.object_loads import ObjectLoad, ObjectSpin
from warpjld.simulation.specification import ContactSpecification

__all__ = ["AppliedLoads", "applied_loads", "idle_forces"]


@dataclass(frozen=True, eq=False)
class AppliedLoads:
    """External loads of one object.

    Attributes:
        name: Name of the object.
        nodal: Concentrated loads, with the nodes of each.
        faces: Surface loads, with the face set of each.
        spin: Steady rotation; None if there is none.
    """

    name: str
    nodal: Sequence[tuple[ObjectLoad, NDArray[np.int64]]] = ()
    faces: Sequence[tuple[ObjectLoad, str]] = ()
    spin: ObjectSpin | None = None

    def __bool__(self) -> bool:
        return bool(self.nodal or self.faces or self.spin is not None)

    def forces(self, frame: float, count: int) -> NDArray[np.float64]:
        """Nodal forces at a frame [N], shape (count, 3): each load is divided equally among its nodes."""
        out = np.zeros((count, 3))
        for load, nodes in self.nodal:
            out[nodes] += np.array([load.at(axis, frame) for axis in "xyz"]) / len(nodes)
        return out

    def added_to(self, loads: Loads, frame: float) -> Loads:
        """``loads`` with the surface loads and the centrifugal force of a frame added."""
        pressure = {face: one.at("pressure", frame) for one, face in self.faces if one.kind == "pressure"}
        traction = {
            face: (one.at("x", frame), one.at("y", frame), one.at("z", frame))
            for one, face in self.faces
            if one.kind == "traction"
        }
        turns = loads.turns
        if self.spin is not None:
            turns = (*turns, Centrifugal(self.spin.axis, self.spin.at(frame), self.spin.point, self.name))
        return replace(
            loads,
            pressure={**loads.pressure, **pressure},
            traction={**loads.traction, **traction},
            centrifugal=turns or None,
        )


def idle_forces(contact: ContactSpecification, loads: AppliedLoads, held: NDArray[np.int64]) -> tuple[str, ...]:
    """Notes on forces that deform nothing, since all their nodes are held.

    Args:
        contact: Specification with the forces.
        loads: The same, applied to the object's mesh.
        held: Nodes that are held to the end.
    """
    named = [points for one, points, kind in contact.loads if one == loads.name and kind == "force"]
    idle = [points for points, (_, nodes) in zip(named, loads.nodal, strict=True) if np.isin(nodes, held).all()]
    return tuple(f"the force on points {points} deforms nothing: they are all held" for points in idle)


def applied_loads(
    contact: ContactSpecification, name: str, mesh: HexMesh, local: NDArray[np.float64]
) -> tuple[AppliedLoads, HexMesh]:
    """Apply the specified loads to an object's mesh.

    Args:
        contact: Specification with the loads.
        name: Name of the object.
        mesh: Its mesh in world coordinates.
        local: Its nodes in the object's own frame [m], shape (N, 3).

    Returns:
        The loads, and the mesh with face sets added for surface loads.

    Raises:
        InputError: A point set selects no node, or no complete face of the surface.
    """
    nodal, faces, sets = [], [], dict(mesh.faces)
    for (one, points, kind), load in contact.loads.items():
        if one != name:
            continue
        try:
            nodes = load.points.choose(local, mesh.nodes)
        except InputError as error:
            raise InputError(f"points {points}: {error.message}") from None
        if kind == "force":
            nodal.append((load, nodes))
            continue
        outside = mesh.faces[name]
        whole = np.isin(mesh.quads(outside), nodes).all(axis=1)
        if not whole.any():
            raise InputError(f"points {points}: no face of the surface lies between them: take more of the object")
        face = f"{name}.{points}.{kind}"
        sets[face] = outside[whole]
        faces.append((load, face))
    out = AppliedLoads(name, tuple(nodal), tuple(faces), contact.spins.get(name))
    return out, replace(mesh, faces=sets) if faces else mesh
