"""Hexahedral mesh of an object: its solid volume, or the wall of a hollow one (R104)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import Body, HexMesh, LinearElastic, Loads, Prescribed, ball_hexes, box_hexes, cylinder_hexes, solve
from warpjld.fem.mesh.embedding import Embedding, embed
from warpjld.fem.output.stress import cauchy
from warpjld.files.kept_values import hash_of, kept_value
from warpjld.geometry.rotations import unit
from warpjld.grasp.objects import GraspObject, Places, VolumeCells
from warpjld.simulation.bodies.fitted_object import FittedObject, fitted_object
from warpjld.simulation.bodies.kept_sources import MESHING
from warpjld.simulation.specification import ObjectMaterial
from warpjld.simulation.volume_object import meshed_cells

__all__ = ["ObjectMesh", "mesh_object"]

_ACROSS = 12
"""Default number of elements across an object's smallest extent."""

_WALL = 2
"""Number of element layers through a wall."""
_MANY = 1e6
"""Largest estimated number of elements of an object."""

_FLAT = 0.03
"""Relative cutoff for the singular values of the mean outer product of the face normals at a node; smaller ones count
as zero, as at a smooth node."""

_UPRIGHT = 0.02
"""Least scaled Jacobian of a wall's elements."""

_REACH = 3.0
"""Largest distance of the visible surface from its mesh, in element edges."""


@dataclass(frozen=True, eq=False)
class ObjectMesh:
    """Volume mesh of a deformable object at time 0.

    Attributes:
        name: Name of its region and of the face set of its outer surface; ``<name>.inside`` is that of its inner one.
        mesh: Mesh in world coordinates.
        local: Its nodes in the object's own frame [m], shape (N, 3).
        physical: Law, wall and pressure.
        visible: Embedding of the visible surface in the mesh.
        surface: Visible surface at time 0 [m], shape (V, 3).
        faces: Triangles of that surface, shape (T, 3).
        regions: Names of the regions of its volume mesh file, if it has one.
        stress: Initial stress, in equilibrium with the inner pressure at time 0 [Pa], shape (E, 6) (R98).
        notes: Messages about cache files that could not be used.
    """

    name: str
    mesh: HexMesh
    local: NDArray[np.float64]
    physical: ObjectMaterial
    visible: Embedding
    surface: NDArray[np.float64]
    faces: NDArray[np.int32]
    stress: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    regions: tuple[str, ...] = ()

    @property
    def inside(self) -> str:
        """Name of the face set of its inner surface."""
        return f"{self.name}.inside"


def mesh_object(name: str, thing: GraspObject, physical: ObjectMaterial, place: Places) -> ObjectMesh:
    """Mesh an object, or read its mesh from the cache.

    Built-in balls, boxes and cylinders get structured meshes, other surfaces a grid fitted to them. The wall of a
    hollow object is extruded inwards from the outer surface at constant depth.

    Args:
        name: Name of the object.
        thing: Its surface.
        physical: Material, wall, pressure and element size.
        place: Placement at time 0 (a batch of one).

    Raises:
        InputError: Elements too large for it, a wall too thick, or a pressure its wall cannot hold.
    """
    shape = replace(physical, where=None, prestress=(0.0,) * 6, regions=())
    cells = None if thing.cells is None else (thing.cells.nodes, thing.cells.elements, thing.cells.regions)
    key = hash_of(name, thing.origin, thing.size, thing.vertices, thing.faces, shape, cells)
    classes = (_Local, HexMesh, Embedding)
    local, notes = kept_value("object", key, classes, lambda: _meshed(name, thing, physical), modules=MESHING)
    turn = place.apply(np.eye(3))[0] - place.apply(np.zeros((1, 3)))[0]
    moved = replace(local.mesh, nodes=place.apply(local.mesh.nodes)[0])
    return ObjectMesh(
        name,
        moved,
        local.mesh.nodes,
        replace(physical, density=local.heavier * physical.density),
        local.visible,
        place.apply(thing.vertices)[0],
        thing.faces,
        _turned(local.stress + np.array(physical.prestress), turn.T),
        (*local.notes, *notes),
        () if thing.cells is None else thing.cells.region_names,
    )


@dataclass(frozen=True, eq=False)
class _Local:
    """Mesh, embedding and initial stress in the object's own frame, which are cached; see ``FittedObject``."""

    mesh: HexMesh
    visible: Embedding
    stress: NDArray[np.float64]
    heavier: float = 1.0
    notes: tuple[str, ...] = ()


def _meshed(name: str, thing: GraspObject, physical: ObjectMaterial) -> _Local:
    """Mesh an object in its own frame (see ``mesh_object``)."""
    if thing.cells is not None:
        return _from_cells(name, thing, thing.cells, physical)
    size = physical.element or float(thing.size.min()) / _ACROSS
    _refuse_many(thing, physical.wall, size)
    thin = min(1.0, physical.wall / (_WALL * size)) if physical.wall else 1.0
    fit: FittedObject | None = None
    if thing.origin == "ball":
        mesh = _ball(thing, physical.wall, size)
    else:
        if thing.origin == "box":
            counts = np.maximum(1, np.round(thing.size / size)).astype(int)
            mesh = box_hexes(thing.size, tuple(counts), origin=thing.vertices.min(axis=0))
        elif thing.origin == "cylinder" and not physical.wall:  # its faces are narrow at the rims
            mesh = _cylinder(thing, size)
        else:
            fit = fitted_object(thing, size, np.inf if physical.wall else _REACH)
            mesh = fit.mesh
        mesh = _shell(mesh, physical.wall) if physical.wall else replace(mesh, faces={"outer": mesh.boundary()})
    faces = {name: mesh.faces["outer"]}
    if physical.wall:
        faces[f"{name}.inside"] = mesh.faces["inner"]
    mesh = replace(
        mesh, regions=np.zeros(len(mesh.elements), np.int32), region_names=(name,), faces=faces, node_sets={}
    )
    stress = _holding(mesh, f"{name}.inside", physical) if physical.pressure else np.zeros((len(mesh.elements), 6))
    if fit is not None and not physical.wall:
        return _Local(mesh, fit.visible, stress, fit.heavier, fit.notes)
    try:
        visible = embed(mesh, thing.vertices, reach=_REACH / thin)
    except InputError as error:
        raise InputError(f"elements of {size:g} m are too large, thin parts are left out ({error.message})") from error
    return _Local(mesh, visible, stress, notes=() if fit is None else fit.notes)


def _from_cells(name: str, thing: GraspObject, cells: VolumeCells, physical: ObjectMaterial) -> _Local:
    """Local mesh made of the volume mesh of an object's file.

    Raises:
        InputError: A wall or an element size is specified, which the file determines.
    """
    if physical.wall or physical.element is not None:
        raise InputError("its file has a volume mesh: HOLLOW and ELEMENT are for surfaces")
    mesh = meshed_cells(name, cells)
    return _Local(mesh, embed(mesh, thing.vertices), np.zeros((len(mesh.elements), 6)))


def _refuse_many(thing: GraspObject, wall: float, size: float) -> None:
    """Reject an element size with more elements than can be solved, before meshing.

    Raises:
        InputError: Estimated number of elements above ``_MANY``.
    """
    x, y, z = (float(extent) for extent in thing.size)
    room = 2.0 * _WALL * (x * y + y * z + z * x) * size if wall else x * y * z
    if room > _MANY * size**3:
        least = (room / size / _MANY) ** 0.5 if wall else (room / _MANY) ** (1.0 / 3.0)
        raise InputError(
            f"elements of {size:g} m would be some {room / size**3:,.0f}: more than can be solved; take {least:.2g} m "
            "or more"
        )


def _ball(thing: GraspObject, wall: float, size: float) -> HexMesh:
    radius = 0.5 * float(thing.size.max())
    count = max(4, 2 * round(0.25 * np.pi * radius / size))
    return ball_hexes(radius, inner=radius - wall if wall else 0.0, n=count, layers=_WALL if wall else None)


def _cylinder(thing: GraspObject, size: float) -> HexMesh:
    radius, length = 0.5 * float(thing.size[0]), float(thing.size[1])
    count = max(4, 2 * round(0.25 * np.pi * radius / size))
    mesh = cylinder_hexes(radius, length, n=count, along=max(2, round(length / size)))
    x, y, z = mesh.nodes.T
    upright = np.stack([x, z - 0.5 * length, -y], axis=1)
    middle = 0.5 * (thing.vertices.min(axis=0) + thing.vertices.max(axis=0))
    return replace(mesh, nodes=upright + middle)


def _shell(solid: HexMesh, wall: float) -> HexMesh:
    """Extrude a wall inwards from the surface of a mesh.

    Nodes move so that all adjacent faces are offset by the same depth, also at edges and corners; where that distorts
    elements, along the mean of that direction and the normal, or along the normal.

    Raises:
        InputError: The wall is so thick that elements fold.
    """
    quads = solid.quads(solid.boundary())
    used, corners = np.unique(quads, return_inverse=True)
    corners = corners.reshape(-1, 4)
    x = solid.nodes[used]
    facing = unit(np.cross(x[corners[:, 2]] - x[corners[:, 0]], x[corners[:, 3]] - x[corners[:, 1]]))
    number = np.bincount(corners.ravel())[:, None]
    normal, planes = np.zeros_like(x), np.zeros((len(x), 3, 3))
    np.add.at(normal, corners, facing[:, None])
    np.add.at(planes, corners, (facing[:, :, None] * facing[:, None, :])[:, None])
    even = np.einsum("nij,nj->ni", np.linalg.pinv(planes / number[:, :, None], rcond=_FLAT), normal / number)
    layers = [
        np.concatenate([corners + k * len(x), corners + (k + 1) * len(x)], axis=1).astype(np.int32)
        for k in range(_WALL)
    ]
    elements = np.concatenate(layers)
    count = len(corners)
    outer = np.stack([(_WALL - 1) * count + np.arange(count), np.full(count, 5)], axis=1).astype(np.int32)
    inner = np.stack([np.arange(count), np.full(count, 4)], axis=1).astype(np.int32)
    for inwards in (even, 0.5 * (even + unit(normal)), unit(normal)):
        nodes = np.concatenate([x - depth * inwards for depth in np.linspace(wall, 0.0, _WALL + 1)])
        mesh = HexMesh(nodes, elements, np.zeros(len(elements), np.int32), ("body",), {"outer": outer, "inner": inner})
        if mesh.scaled_jacobian().min() > _UPRIGHT:
            return mesh
    raise InputError(f"wall: {wall:g} m is too thick, the wall would fold; take a thinner one")


def _holding(mesh: HexMesh, inside: str, physical: ObjectMaterial) -> NDArray[np.float64]:
    """Stress of a linear elastic body of that shape under the inner pressure [Pa], shape (E, 6).

    Raises:
        InputError: The pressure strains the wall by more than half.
    """
    body = Body(mesh, LinearElastic(physical.young, physical.poisson))
    unconstrained = Prescribed(np.empty(0, np.int64), np.empty(0))
    found = solve(body, unconstrained, Loads(pressure={inside: physical.pressure}), free="hold")
    strain = float(np.abs(found.displacement).max()) / mesh.size
    if strain > 0.5:
        raise InputError(
            f"pressure: {physical.pressure:g} Pa would burst a wall of {physical.wall:g} m with a modulus of "
            f"{physical.young:g} Pa"
        )
    return cauchy(body, found.displacement)


def _turned(stress: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stresses xx yy zz xy yz zx (E, 6), rotated by a matrix (3, 3)."""
    full = stress[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    full = np.einsum("ij,ejk,lk->eil", turn, full, turn)
    return np.stack([full[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)
