"""Generated meshes: boxes; and balls, cylinders and fingers as O-grids (cubed sphere)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.mesh.hexmesh import HexMesh, elements_of
from warpjld.fem.mesh.ogrid import Ogrid, ogrid_hexes

__all__ = ["ball_hexes", "box_hexes", "cylinder_hexes", "finger_hexes"]


def box_hexes(
    size: ArrayLike = (1.0, 1.0, 1.0),
    counts: tuple[int, int, int] = (8, 8, 8),
    *,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    name: str = "body",
) -> HexMesh:
    """A box of ``counts`` elements with face sets ``x-``, ``x+``, ``y-``, ``y+``, ``z-``, ``z+``.

    Args:
        size: Edge lengths [m].
        counts: Elements along x, y, z.
        origin: Lowest corner [m].
        name: Region name.

    Raises:
        InputError: A size or count that is not positive.
    """
    lengths = np.asarray(size, dtype=np.float64)
    if lengths.shape != (3,) or not (lengths > 0).all():
        raise InputError(f"size: want three positive lengths, got {lengths}")
    if len(counts) != 3 or min(counts) < 1:
        raise InputError(f"counts: want three positive numbers of elements, got {counts}")
    lines = [np.linspace(0.0, length, n + 1) for length, n in zip(lengths, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3) + np.asarray(origin, dtype=np.float64)
    grid = np.arange(len(nodes), dtype=np.int32).reshape([n + 1 for n in counts])
    elements = elements_of(grid)
    cells = np.arange(len(elements), dtype=np.int32).reshape(counts)
    faces = {}
    for axis, letter in enumerate("xyz"):
        for end, sign in ((0, "-"), (-1, "+")):
            chosen = np.take(cells, end, axis=axis).ravel()
            faces[letter + sign] = np.stack([chosen, np.full_like(chosen, 2 * axis + (end != 0))], axis=1)
    return HexMesh(nodes, elements, np.zeros(len(elements), np.int32), (name,), faces, {}, (grid,))


_ALL = ("x-", "x+", "y-", "y+", "z-", "z+")
_ROUND = 0.45
"""Shape of the core, from a cube (0) to a ball (1): keeps angles at its edges open enough."""


def ball_hexes(
    radius: float = 1.0, *, inner: float = 0.0, n: int = 8, layers: int | None = None, octant: bool = False
) -> HexMesh:
    """A ball or a spherical shell about the origin.

    Regions: ``core`` and ``envelope`` if solid, ``envelope`` if hollow. Faces: ``outer``; ``inner`` of a shell; and
    of an octant (x, y, z ≥ 0) the symmetry planes ``x0``, ``y0``, ``z0``.

    Args:
        radius: Outer radius [m].
        inner: Inner radius of a shell [m]; 0 for a solid ball.
        n: Elements along an edge of each of the six patches (of an octant's three, half the edge of a whole ball's).
        layers: Elements through the wall, or from core to surface; n/2 by default if solid, else as thick as wide.
        octant: Whether to make one eighth only.

    Raises:
        InputError: Radii or counts out of range.
    """
    if not radius > 0 or not 0 <= inner < radius:
        raise InputError(f"want 0 ≤ inner < radius, got inner = {inner} and radius = {radius}")
    if n < 1:
        raise InputError(f"n: want at least one element, got {n}")
    solid = inner == 0.0
    if layers is None:
        wide = (1.0 if octant else 0.5) * n
        layers = max(1, round(wide if solid else wide * 1.27 * 2 * (radius - inner) / (radius + inner)))
    sides = ("x+", "y+", "z+") if octant else _ALL
    topology = ogrid_hexes((n, n, n), layers, sides, core=solid)
    s = topology.place / n if octant else 2.0 * topology.place / n - 1.0
    nodes = _round(s, topology.layer / layers, radius, 0.5 * radius if solid else inner, np.ones(3), solid)
    return _mesh(
        topology, nodes, ("core", "envelope") if solid else ("envelope",), {"x-": "x0", "y-": "y0", "z-": "z0"}
    )


def cylinder_hexes(
    radius: float = 1.0,
    length: float = 2.0,
    *,
    inner: float = 0.0,
    n: int = 8,
    layers: int | None = None,
    along: int = 8,
    quarter: bool = False,
) -> HexMesh:
    """A cylinder about the z axis from z = 0, solid with a core (such as a bone) or a tube.

    Regions: ``core`` and ``envelope`` if solid, ``envelope`` if hollow. Faces: ``outer``, ``bottom``, ``top``;
    ``inner`` of a tube; of a quarter (x, y ≥ 0) the symmetry planes ``x0``, ``y0``.

    Args:
        radius: Outer radius [m].
        length: Length [m].
        inner: Radius of the bore [m]; 0 for a solid cylinder, whose core has half the radius.
        n: Elements along an edge of each of the four patches (of a quarter's two, half of that edge).
        layers: Elements through the wall; n/2 by default.
        along: Elements along z.
        quarter: Whether to make one quarter only.

    Raises:
        InputError: Radii, length or counts out of range.
    """
    if not radius > 0 or not 0 <= inner < radius or not length > 0:
        raise InputError(f"want 0 ≤ inner < radius and length > 0, got {inner}, {radius} and {length}")
    solid = inner == 0.0
    layers = layers or max(1, n if quarter else n // 2)
    sides = ("x+", "y+") if quarter else _ALL[:4]
    topology = ogrid_hexes((n, n, along), layers, sides, core=solid)
    s = topology.place / n if quarter else 2.0 * topology.place / n - 1.0
    s[:, 2] = 0.0
    flat = np.array([1.0, 1.0, 0.0])
    nodes = _round(s, topology.layer / layers, radius, 0.5 * radius if solid else inner, flat, solid)
    nodes[:, 2] = topology.place[:, 2] * (length / along)
    names = {"z-": "bottom", "z+": "top", "x-": "x0", "y-": "y0"}
    return _mesh(topology, nodes, ("core", "envelope") if solid else ("envelope",), names)


def finger_hexes(
    radius: float = 0.008,
    length: float = 0.05,
    *,
    bone: float = 0.45,
    n: int = 8,
    layers: int | None = None,
    along: int = 16,
) -> HexMesh:
    """A finger about the z axis with an open base at z = 0, a round tip at z = length, and a bone inside.

    Regions: ``bone`` and ``flesh``. Faces: ``skin`` (outer) and ``base``.

    Args:
        radius: Radius of the skin [m].
        length: Length from base to tip [m].
        bone: Radius of the bone, per radius of the skin.
        n: Elements across the bone, an even number.
        layers: Elements from bone to skin; n/2 by default.
        along: Elements along the straight part.

    Raises:
        InputError: Measures out of range.
    """
    if not 0 < radius < length or not 0 < bone < 1:
        raise InputError(f"want 0 < radius < length and 0 < bone < 1, got {radius}, {length} and {bone}")
    if n < 2 or n % 2:
        raise InputError(f"n: want an even number of elements across the bone, got {n}")
    layers = layers or n // 2
    cap = n // 2
    topology = ogrid_hexes((n, n, along + cap), layers, (*_ALL[:4], "z+"), core=True)
    straight = np.minimum(topology.place[:, 2], along)
    s = 2.0 * topology.place / n - 1.0
    s[:, 2] = (topology.place[:, 2] - straight) / cap
    nodes = _round(s, topology.layer / layers, radius, bone * radius, np.ones(3), True)
    nodes[:, 2] += straight * ((length - radius) / along)
    mesh = _mesh(topology, nodes, ("bone", "flesh"), {"z-": "base"})
    return HexMesh(
        mesh.nodes,
        mesh.elements,
        mesh.regions,
        mesh.region_names,
        {"skin" if name == "outer" else name: faces for name, faces in mesh.faces.items()},
        {},
        mesh.blocks,
    )


def _round(s: Array, depth: Array, outer: float, inner: float, axes: Array, solid: bool) -> Array:
    """Positions of nodes of the cube |s| ≤ 1 (or square, by ``axes``) and of the layers around it, on rounded shapes.

    Directions are equiangular, tan(π s/4), so that elements of a patch have similar sizes.
    """
    bent = np.tan(0.25 * np.pi * s) * axes
    norm = np.linalg.norm(bent, axis=1)
    direction = np.divide(bent, norm[:, None], out=np.zeros_like(bent), where=norm[:, None] > 0)
    if not solid:
        return direction * (inner + (outer - inner) * depth)[:, None]
    reach = np.abs(s * axes).max(axis=1)
    corner = np.sqrt(axes.sum())
    # core: a blend of a cube and a ball of similar size; layers: straight lines from there to the surface
    cube = s * axes * (2.0 / (1.0 + corner))
    core = inner * ((1.0 - _ROUND) * cube + _ROUND * direction * reach[:, None])
    return core + depth[:, None] * (outer * direction - core)


def _mesh(topology: Ogrid, nodes: Array, regions: tuple[str, ...], names: dict[str, str]) -> HexMesh:
    faces = {"outer": topology.outer}
    if len(topology.inner):
        faces["inner"] = topology.inner
    faces |= {names[side]: found for side, found in topology.ends.items()}
    region = np.zeros(len(topology.elements), np.int32)
    region[topology.core :] = len(regions) - 1
    return HexMesh(nodes, topology.elements, region, regions, faces, {}, topology.blocks)
