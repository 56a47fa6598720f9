"""Meshes that contact tests share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from warpjld.fem import Body, HexMesh, Material, Prescribed, merge, prescribe
from warpjld.fem.contact import ContactInstant
from warpjld.fem.contact.solids import Plane

FREE = Prescribed(np.empty(0, np.int64), np.empty(0))


def named(mesh: HexMesh, name: str, shift: ArrayLike = (0.0, 0.0, 0.0)) -> HexMesh:
    """A mesh moved, as one region, with the region's name before those of its faces."""
    return replace(
        mesh,
        nodes=mesh.nodes + np.asarray(shift, dtype=np.float64),
        regions=np.zeros(len(mesh.elements), np.int32),
        region_names=(name,),
        faces={f"{name}.{face}": chosen for face, chosen in mesh.faces.items()},
    )


def together(parts: dict[str, tuple[HexMesh, Material]]) -> Body:
    """Bodies by name, merged."""
    mesh = merge(*(part for part, _ in parts.values()))
    return Body(mesh, {name: law for name, (_, law) in parts.items()})


def symmetric(mesh: HexMesh) -> Prescribed:
    """An octant's planes of symmetry."""
    return prescribe(mesh, "x0", x=0.0) + prescribe(mesh, "y0", y=0.0) + prescribe(mesh, "z0", z=0.0)


def lid(travel: float, height: float = 1.0) -> Plane:
    """A plate that comes down by ``travel`` [m] up to time 1."""
    return Plane((0, 0, height), (0, 0, -1), motion=lambda t: ((0.0, 0.0, -travel * t), (0.0, 0.0, 0.0, 1.0)))


def deepest_overlap(body: Body, instant: ContactInstant, slave: str, master: str, reach: float) -> float:
    """How deep points of one surface lie inside the other body, found without the solver's own points [m].

    Nodes of each surface against the triangles of the other that face them, no farther than ``reach``.
    """
    import trimesh

    mesh = body.mesh.moved(instant.displacement)
    worst = 0.0
    for mine, other in ((slave, master), (master, slave)):
        quads = mesh.quads(mesh.face_set(other))
        surface = trimesh.Trimesh(mesh.nodes, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), process=False)
        points = mesh.nodes[mesh.node_set(mine)]
        closest, distance, triangle = trimesh.proximity.closest_point(surface, points)
        inside = np.einsum("ni,ni->n", points - closest, surface.face_normals[triangle]) < 0.0
        worst = max(worst, float(distance[inside & (distance < reach)].max(initial=0.0)))
    return worst
