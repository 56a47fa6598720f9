"""Meshes that contact tests share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from warpjld.fem import Body, HexMesh, Material, Prescribed, merge, prescribe
from warpjld.fem.contact import ContactInstant
from warpjld.fem.contact.obstacles.solids import Plane

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


def mean_gaps(body: Body, instant: ContactInstant, slave: str, master: str, samples: int = 8) -> np.ndarray:
    """Gap of two deformed surfaces averaged over the surroundings of each slave node where they meet [m], shape (n,).

    Found without the solver's own points: signed distances, negative inside, of a fine lattice on every slave face,
    weighted with the node's shape function. Between two polyhedra the distance itself swings about this mean by their
    sag, edge² / 8R.
    """
    import trimesh

    mesh = body.mesh.moved(instant.displacement)
    quads = mesh.quads(mesh.face_set(master))
    surface = trimesh.Trimesh(mesh.nodes, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), process=False)
    line = (np.arange(samples) + 0.5) / samples
    s, t = (v.ravel() for v in np.meshgrid(line, line))
    shape = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
    faces = mesh.quads(mesh.face_set(slave))
    touch = instant.touches[0]
    pressed = set(touch.nodes[(touch.pressure > 0.0) & (touch.gap < 1e-3 * np.sqrt(touch.area))].tolist())
    faces = faces[np.isin(faces, list(pressed)).any(axis=1)]
    points = np.einsum("qk,fki->fqi", shape, mesh.nodes[faces]).reshape(-1, 3)
    closest, _, triangle = trimesh.proximity.closest_point(surface, points)
    gap = np.einsum("ni,ni->n", points - closest, surface.face_normals[triangle]).reshape(len(faces), -1)
    total, weight = np.zeros(len(mesh.nodes)), np.zeros(len(mesh.nodes))
    a, b, c, d = (mesh.nodes[faces[:, k]] for k in range(4))
    area = np.linalg.norm(np.cross(c - a, d - b), axis=1)
    np.add.at(total, faces, area[:, None] * (gap @ shape))
    np.add.at(weight, faces, area[:, None] * shape.sum(axis=0))
    chosen = sorted(pressed)
    return total[chosen] / weight[chosen]
