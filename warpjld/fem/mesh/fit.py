"""Grid-based hexahedral meshing of a closed surface: a core of grid cells, one layer on its faces, fitted nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.mesh.core import core_of
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.hexmesh import HexMesh, elements_of, nodal_area_vectors
from warpjld.fem.mesh.untangle import improve
from warpjld.geometry.rotations import unit

__all__ = ["Fit", "fit_mesh", "mesh_surface_file"]

_REPAIRS = 5
"""Further rounds in which the pull to the surface is reduced around bad elements."""
_RETURNS = 6
"""Final rounds in which reduced pulls are increased again."""
_CLOSE = 0.05
"""Largest distance of boundary nodes from the surface, in spacings, at which the final rounds end."""
_NEARER = 0.9
"""Largest ratio of distances of successive final rounds that counts as progress."""
_FOLLOWING = 0.3
"""Pull of nodes that follow their neighbours, per pull of others."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted mesh with quality measures.

    Attributes:
        mesh: The mesh; the face set ``surface`` is its boundary.
        least: Smallest scaled Jacobian.
        mean: Mean scaled Jacobian.
        gap: Largest distance of a boundary node from the surface [m].
        volume: Volume of the mesh per volume of the surface.
        notes: Information for the user.
    """

    mesh: HexMesh
    least: float
    mean: float
    gap: float
    volume: float
    notes: tuple[str, ...]


def fit_mesh(envelope: Envelope, spacing: float, *, least: float = 0.1, name: str = "body", rounds: int = 4) -> Fit:
    """Mesh the inside of a surface.

    Args:
        envelope: The surface, watertight or not.
        spacing: Edge length of the elements [m].
        least: Smallest scaled Jacobian; boundary nodes stay off the surface where it would not be kept.
        name: Region name.
        rounds: Number of rounds of moving nodes and updating their closest points.

    Raises:
        InputError: A spacing too coarse for the surface, or so fine that memory would not suffice; quality not reached.
    """
    if not spacing > 0:
        raise InputError(f"spacing: want a length above 0 m, got {spacing}")
    notes: list[str] = []
    if not envelope.watertight:
        notes.append(
            f"the surface is not watertight ({envelope.open_edges} open edges, {envelope.crowded_edges} edges with "
            "more than two faces): holes were closed, inside and outside told apart by winding number"
        )
    cells, origin = core_of(envelope, spacing, notes)
    mesh, boundary = _with_boundary_layer(cells, origin, spacing, name)
    fitted, backed = _fit_boundary(mesh, boundary, envelope, spacing, least, rounds)
    quality = fitted.scaled_jacobian()
    if quality.min() < least:
        raise InputError(
            f"mesh: least scaled Jacobian {quality.min():.3f} below {least} ({int((quality < least).sum())} of "
            f"{len(quality)} elements): a smaller spacing than {spacing:g} m is needed"
        )
    gap = float(np.abs(envelope.ask(fitted.nodes[boundary]).distance).max())
    if backed:
        notes.append(f"{backed} of {len(boundary)} boundary nodes stay off the surface, by {1e3 * gap:.2g} mm at most")
    x = fitted.nodes[fitted.quads(fitted.face_set("surface"))]
    volume = float(np.einsum("fi,fi->", x.mean(axis=1), np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]))) / 6.0
    return Fit(fitted, float(quality.min()), float(quality.mean()), gap, volume / envelope.volume, tuple(notes))


def mesh_surface_file(path: Path, *, spacing: float, scale: float = 1.0) -> Fit:
    """Mesh the inside of a surface file (OBJ, STL, PLY, …), scaled to metres.

    Raises:
        InputError: Unreadable, or it cannot be meshed at this spacing.
    """
    import trimesh

    if not path.is_file():
        raise InputError("no such file", path=path)
    try:
        loaded = trimesh.load(path, force="mesh", process=True)
    except Exception as error:
        raise InputError(f"not a surface that can be read: {error}", path=path) from error
    return fit_mesh(Envelope(scale * np.asarray(loaded.vertices), np.asarray(loaded.faces)), spacing)


def _with_boundary_layer(cells: Mask, origin: Array, spacing: float, name: str) -> tuple[HexMesh, Ints]:
    """The core's cells with one layer of elements on each free face, and the nodes of the boundary."""
    shape = [n + 1 for n in cells.shape]
    every = elements_of(np.arange(int(np.prod(shape)), dtype=np.int32).reshape(shape))[cells.ravel()]
    used, elements = np.unique(every, return_inverse=True)
    elements = np.asarray(elements.reshape(-1, 8), dtype=np.int32)
    lattice = np.stack(np.unravel_index(used, shape), axis=1).astype(np.int32)
    nodes = origin + spacing * lattice
    core = HexMesh(nodes, np.asarray(elements, dtype=np.int32), np.zeros(len(elements), np.int32), (name,))
    quads = core.quads(core.boundary())
    skin = np.unique(quads)
    outer = np.full(len(nodes), -1, np.int32)
    outer[skin] = len(nodes) + np.arange(len(skin), dtype=np.int32)
    outwards = unit(nodal_area_vectors(nodes, quads)[skin])
    layer = np.concatenate([quads, outer[quads]], axis=1)
    all_elements = np.concatenate([elements, layer]).astype(np.int32)
    faces = np.stack([len(elements) + np.arange(len(layer)), np.full(len(layer), 5)], axis=1).astype(np.int32)
    # for multigrid, a layer node is at the lattice point one cell outwards
    grown = lattice[skin] + np.rint(outwards * 1.2).astype(np.int32)
    mesh = HexMesh(
        np.concatenate([nodes, nodes[skin] + 0.6 * spacing * outwards]),
        all_elements,
        np.zeros(len(all_elements), np.int32),
        (name,),
        {"surface": faces},
        {},
        (),
        np.concatenate([lattice, grown]),
    )
    return mesh, len(nodes) + np.arange(len(skin))


def _fit_boundary(
    mesh: HexMesh, boundary: Ints, envelope: Envelope, spacing: float, least: float, rounds: int
) -> tuple[HexMesh, int]:
    """Move boundary nodes to the surface and keep elements well shaped, as far as both are possible.

    Boundary nodes are pulled to their closest points with increasing weight; around bad elements the pull is reduced,
    and nodes whose closest point faces the other way (the far side of a fold, a neighbouring finger) follow their
    neighbours. Once all elements are good, the pull is increased again as long as this reduces the distance. Returns
    the mesh and the number of nodes off the surface.
    """
    quads = mesh.quads(mesh.face_set("surface"))
    links = _adjacency(quads, boundary)
    nodes = mesh.nodes
    relaxed = np.ones(len(boundary))
    best: tuple[HexMesh, int] | None = None
    nearest = np.inf
    for number in range(rounds + _REPAIRS + _RETURNS):
        answer = envelope.ask(nodes[boundary])
        outwards = nodal_area_vectors(nodes, quads)
        agrees = np.einsum("bi,bi->b", outwards[boundary], answer.normal) > 0.0
        target, normal = _follow_neighbours(nodes[boundary], answer.closest, answer.normal, agrees, links)
        strength = (2.0, 10.0, 30.0)[min(number, 2)] * relaxed * np.where(agrees, 1.0, _FOLLOWING)
        nodes = improve(
            nodes,
            mesh.elements,
            spacing,
            boundary,
            target,
            normal,
            pull=strength,
            softness=0.3 if number == 0 else 0.03,
        )
        if number + 1 < rounds:
            continue
        moved = replace(mesh, nodes=nodes)
        snapped = _projected(moved, boundary, agrees & (relaxed > 0.01), envelope, least)
        if snapped[0].scaled_jacobian().min() >= least:
            away = float(np.abs(envelope.ask(snapped[0].nodes[boundary]).distance).max())
            if best is None or away < _NEARER * nearest:
                best, nearest = snapped, away
            elif number + 1 >= rounds + _REPAIRS:
                return best
            if nearest < _CLOSE * spacing or number + 1 == rounds + _REPAIRS + _RETURNS:
                return best
            nodes = snapped[0].nodes
            relaxed = np.minimum(1.0, 8.0 * relaxed)
            continue
        if best is not None and number + 1 >= rounds + _REPAIRS:
            return best
        quality = moved.scaled_jacobian()
        suffering = np.zeros(len(nodes), dtype=bool)
        suffering[mesh.elements[quality < 2.0 * least]] = True
        for _ in range(2):
            suffering[mesh.elements[suffering[mesh.elements].any(axis=1)]] = True
        relaxed[suffering[boundary]] *= 0.03
    return snapped if best is None else best


def _adjacency(quads: Ints32, boundary: Ints) -> Any:
    """Adjacency of boundary nodes by edges, a symmetric ``csr_array`` (B, B)."""
    row = np.searchsorted(boundary, quads)
    one, other = row.ravel(), np.roll(row, -1, axis=1).ravel()
    table = csr_array((np.ones(len(one)), (one, other)), shape=(len(boundary), len(boundary)))
    return table + table.T


def _follow_neighbours(nodes: Array, closest: Array, normal: Array, agrees: Mask, links: Any) -> tuple[Array, Array]:
    """Targets and normals; nodes with an invalid closest point take the mean displacement of their neighbours."""
    move = np.where(agrees[:, None], closest - nodes, 0.0)
    facing = np.where(agrees[:, None], normal, 0.0)
    known = agrees.copy()
    while not known.all():
        count = links @ known.astype(float)
        next_ = ~known & (count > 0.0)
        if not next_.any():
            break
        move[next_] = (links @ np.where(known[:, None], move, 0.0))[next_] / count[next_, None]
        facing[next_] = (links @ np.where(known[:, None], facing, 0.0))[next_]
        known |= next_
    size = np.linalg.norm(facing, axis=1, keepdims=True)
    return nodes + move, np.where(size > 1e-6, facing / np.maximum(size, 1e-6), normal)


def _projected(mesh: HexMesh, boundary: Ints, chosen: Mask, envelope: Envelope, least: float) -> tuple[HexMesh, int]:
    """The mesh with boundary nodes projected on the surface, less far at elements that would become worse than
    ``least``; and the number of nodes that are not on it."""
    start = mesh.nodes
    goal = start.copy()
    goal[boundary] = envelope.ask(start[boundary]).closest
    share = np.ones(len(start))
    share[boundary[~chosen]] = 0.0
    for _ in range(12):
        there = replace(mesh, nodes=start + share[:, None] * (goal - start))
        bad = there.scaled_jacobian() < least
        if not bad.any():
            break
        share[np.unique(mesh.elements[bad])] *= 0.5
    return there, int((share[boundary] < 1.0).sum())
