"""Meshes of 8-node hexahedra with regions and named face and node sets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.suggest import one_of

__all__ = ["EDGES", "FACES", "HexMesh", "elements_of", "merge", "nodal_area_vectors"]

FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]], dtype=np.int32)
"""Corners of the faces −x, +x, −y, +y, −z, +z of an element, anticlockwise seen from outside, shape (6, 4)."""

EDGES = np.array(
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]], dtype=np.int32
)
"""Corners at the ends of an element's edges, shape (12, 2)."""

_CORNERS = np.array(  # corner, and its three neighbours in right-handed order
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]], dtype=np.int32
)


@dataclass(frozen=True, eq=False)
class HexMesh:
    """N nodes and E elements with eight corners in the order of VTK's hexahedron (B §3.2, R96).

    Corners may coincide: with 2 = 3 and 6 = 7 an element is a prism, with also 4 = 5 = 6 = 7 a tetrahedron.

    Attributes:
        nodes: Rest positions [m], shape (N, 3).
        elements: Nodes, shape (E, 8).
        regions: Region of each element, an index into ``region_names``, shape (E,).
        region_names: Names of the regions, to which materials are assigned.
        faces: Named face sets: element and local face (see ``FACES``), shape (F, 2) each.
        node_sets: Named nodes, shape (n,) each.
        blocks: Structured grids of node indices, shape (ni + 1, nj + 1, nk + 1) each, that together form the mesh;
            empty if it is unstructured. A multigrid hierarchy takes every other line of them.
        lattice: Integer coordinates of the nodes on a regular grid, shape (N, 3), for meshes made from one.
        parts: The meshes that were merged into this one, in the order of their nodes; empty for a single mesh.
    """

    nodes: Array
    elements: Ints32
    regions: Ints32
    region_names: tuple[str, ...] = ("body",)
    faces: dict[str, Ints32] = field(default_factory=dict)
    node_sets: dict[str, Ints32] = field(default_factory=dict)
    blocks: tuple[Ints32, ...] = ()
    lattice: Ints32 | None = None
    parts: tuple[HexMesh, ...] = ()

    def __post_init__(self) -> None:
        if self.nodes.ndim != 2 or self.nodes.shape[1] != 3:
            raise InputError(f"nodes: want shape (n, 3), got {self.nodes.shape}")
        if self.elements.ndim != 2 or self.elements.shape[1] != 8 or len(self.elements) == 0:
            raise InputError(f"elements: want shape (n, 8) with n > 0, got {self.elements.shape}")
        if not np.isfinite(self.nodes).all():
            raise InputError(f"nodes: node {int(np.argwhere(~np.isfinite(self.nodes))[0][0])} is not finite")
        if self.elements.min() < 0 or self.elements.max() >= len(self.nodes):
            raise InputError(
                f"elements: corners must lie in 0…{len(self.nodes) - 1}, got "
                f"{self.elements.min()}…{self.elements.max()}"
            )
        if self.regions.shape != (len(self.elements),):
            raise InputError(f"regions: want shape ({len(self.elements)},), got {self.regions.shape}")

    def __repr__(self) -> str:
        return (
            f"HexMesh({len(self.nodes)} nodes, {len(self.elements)} elements, regions {', '.join(self.region_names)})"
        )

    @property
    def size(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def boundary(self) -> Ints32:
        """Faces of one element only, the surface of the mesh: element and local face, shape (F, 2) (R96)."""
        corners = np.sort(self.elements[:, FACES].reshape(-1, 4), axis=1)
        repeated = np.zeros(corners.shape, dtype=bool)
        repeated[:, 1:] = corners[:, 1:] == corners[:, :-1]
        corners[repeated] = -1  # degenerate quads are the same triangle whichever corner is repeated
        corners.sort(axis=1)
        order = np.lexsort(corners.T)
        fresh = np.ones(len(corners) + 1, dtype=bool)
        fresh[1:-1] = (corners[order[1:]] != corners[order[:-1]]).any(axis=1)
        single = np.zeros(len(corners), dtype=bool)
        single[order] = fresh[:-1] & fresh[1:]
        single &= repeated.sum(axis=1) <= 1
        index = np.flatnonzero(single)
        return np.stack([index // 6, index % 6], axis=1).astype(np.int32)

    def edges(self) -> Ints32:
        """Node pairs joined by element edges, smaller index first, sorted and unique, shape (n, 2)."""
        ends = np.sort(self.elements[:, EDGES].reshape(-1, 2), axis=1).astype(np.int64)
        count = len(self.nodes)
        keys = np.unique(ends[:, 0] * count + ends[:, 1])
        ends = np.stack([keys // count, keys % count], axis=1).astype(np.int32)
        return np.ascontiguousarray(ends[ends[:, 0] != ends[:, 1]])

    def quads(self, faces: Ints32) -> Ints32:
        """Corners of faces given as (element, local face), anticlockwise seen from outside, shape (F, 4)."""
        return self.elements[faces[:, :1], FACES[faces[:, 1]]]

    def face_set(self, name: str) -> Ints32:
        """The face set of a name; ``surface`` is the whole boundary.

        Raises:
            InputError: Unknown name.
        """
        if name in self.faces:
            return self.faces[name]
        if name == "surface":
            return self.boundary()
        raise InputError(_unknown("face set", name, [*self.faces, "surface"]))

    def node_set(self, name: str) -> Ints32:
        """Nodes of a node set, face set or region.

        Raises:
            InputError: Unknown name.
        """
        if name in self.node_sets:
            return self.node_sets[name]
        if name in self.faces or name == "surface":
            return np.unique(self.quads(self.face_set(name))).astype(np.int32)
        if name in self.region_names:
            return np.unique(self.elements[self.region(name)]).astype(np.int32)
        raise InputError(_unknown("node set", name, [*self.node_sets, *self.faces, "surface", *self.region_names]))

    def region(self, name: str) -> Mask:
        """Mask of the elements of a region.

        Raises:
            InputError: Unknown region.
        """
        if name not in self.region_names:
            raise InputError(_unknown("region", name, list(self.region_names)))
        return self.regions == self.region_names.index(name)

    def scaled_jacobian(self) -> Array:
        """Smallest scaled Jacobian over the corners of each element: 1 for a box, ≤ 0 if inverted, shape (E,).

        Corners with collapsed edges (of prisms, tetrahedra) are skipped.
        """
        x = self.nodes[self.elements]
        out = np.full(len(x), np.inf)
        for corner in range(8):
            edges = x[:, _CORNERS[corner]] - x[:, corner, None]
            length = np.linalg.norm(edges, axis=2).prod(axis=1)
            volume = np.einsum("ei,ei->e", edges[:, 0], np.cross(edges[:, 1], edges[:, 2]))
            solid = length > 0
            out[solid] = np.minimum(out[solid], volume[solid] / length[solid])
        return out

    def moved(self, displacement: Array) -> HexMesh:
        """The same mesh with displaced nodes."""
        return replace(self, nodes=self.nodes + displacement.reshape(-1, 3))

    def with_nodes(self, **sets: Ints32) -> HexMesh:
        """The same mesh with further node sets."""
        return replace(self, node_sets={**self.node_sets, **sets})


def nodal_area_vectors(x: Array, quads: Ints32) -> Array:
    """Sum of twice the area vectors of the quadrilaterals (F, 4) around every node at positions x (N, 3) [m²], (N, 3);
    zero at nodes of none."""
    corners = x[quads]
    out = np.zeros_like(x)
    crossed = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    np.add.at(out, quads, crossed[:, None, :].repeat(4, axis=1))
    return out


def elements_of(grid: Ints32) -> Ints32:
    """Elements of a structured grid of node indices (ni + 1, nj + 1, nk + 1), x index slowest, shape (ni nj nk, 8)."""
    low, high = slice(None, -1), slice(1, None)
    corners = [
        grid[low, low, low],
        grid[high, low, low],
        grid[high, high, low],
        grid[low, high, low],
        grid[low, low, high],
        grid[high, low, high],
        grid[high, high, high],
        grid[low, high, high],
    ]
    return np.stack([c.ravel() for c in corners], axis=1).astype(np.int32)


def merge(*meshes: HexMesh) -> HexMesh:
    """Several unconnected bodies as one mesh; sets of the same name are united (R101)."""
    names = tuple(dict.fromkeys(name for mesh in meshes for name in mesh.region_names))
    offset = 0
    count = 0
    nodes, elements, regions, blocks = [], [], [], []
    faces: dict[str, list[Ints32]] = {}
    sets: dict[str, list[Ints32]] = {}
    for mesh in meshes:
        nodes.append(mesh.nodes)
        elements.append(mesh.elements + offset)
        regions.append(np.array([names.index(n) for n in mesh.region_names], dtype=np.int32)[mesh.regions])
        blocks += [grid + offset for grid in mesh.blocks]
        for name, part in mesh.faces.items():
            faces.setdefault(name, []).append(part + np.array([count, 0], dtype=np.int32))
        for name, chosen in mesh.node_sets.items():
            sets.setdefault(name, []).append(chosen + offset)
        offset += len(mesh.nodes)
        count += len(mesh.elements)
    return HexMesh(
        nodes=np.concatenate(nodes),
        elements=np.concatenate(elements).astype(np.int32),
        regions=np.concatenate(regions),
        region_names=names,
        faces={n: np.concatenate(p) for n, p in faces.items()},
        node_sets={n: np.concatenate(p) for n, p in sets.items()},
        blocks=tuple(blocks) if all(mesh.blocks for mesh in meshes) else (),
        parts=tuple(part for mesh in meshes for part in (mesh.parts or (mesh,))),
    )


def _unknown(kind: str, name: str, known: list[str]) -> str:
    return f"no {kind} '{name}'{one_of(name, known)}"
