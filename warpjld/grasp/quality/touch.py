"""Contact patches of skin on an object: one per part of the hand, with centre, normals and area."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.normals import vertex_normals
from warpjld.grasp.quality.contacts import Contacts, patch_spin

__all__ = ["ContactPatches", "contact_patches", "vertex_areas"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactPatches:
    """P contact patches, one for each part of the hand that touches.

    Attributes:
        names: Part of each patch, e.g. ``index.knuckle3``.
        points: Centre of each patch on the object [m], shape (P, 3).
        normals: Unit normal of the object there, pointing into it, shape (P, 3).
        skin_normals: Mean unit normal of the skin, pointing out of the hand, shape (P, 3). Equals ``normals`` where the
            skin lies flat on the object.
        areas: Area of skin in contact [m²], shape (P,).
        vertices: Number of skin vertices in contact, shape (P,).
    """

    names: tuple[str, ...]
    points: Array
    normals: Array
    skin_normals: Array
    areas: Array
    vertices: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def digits(self) -> tuple[str, ...]:
        """Digit of each patch, or ``palm``: the part's name up to the first dot."""
        return tuple(name.partition(".")[0] for name in self.names)

    def contacts(self, friction: float) -> Contacts:
        """The patches as soft fingers: Coulomb friction μ, torsional friction of a round patch of their area."""
        spin = patch_spin(friction, self.areas)
        return Contacts(self.points, self.normals, np.array(friction), spin, digits=self.digits, areas=self.areas)


def contact_patches(
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    parts: NDArray[np.integer],
    names: Sequence[str],
    distances: NDArray[np.floating],
    nearest: NDArray[np.floating],
    outward: NDArray[np.floating],
    *,
    tolerance: float,
) -> ContactPatches:
    """Patches of skin within a tolerance of the object, one per part.

    A vertex i in contact (signed distance d_i ≤ tolerance) represents its barycentric area A_i, a third of the
    triangles around it (Meyer, Desbrun, Schröder & Barr 2003). Over the vertices in contact of one part:

        area = Σ A_i,   point = Σ A_i p_i / Σ A_i,   normal ∝ −Σ A_i n_i,   skin normal ∝ Σ A_i s_i,

    p_i the nearest points of the object, n_i its outward normals there, s_i the skin's normals. A part whose normals
    cancel has no direction to push in, and is left out.

    Args:
        vertices: Deformed skin [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        parts: Part of every vertex, shape (V,); -1 for vertices to be ignored.
        names: Names of the parts.
        distances: Signed distance of every vertex to the object [m], negative inside, shape (V,).
        nearest: Nearest points of the object [m], shape (V, 3); only those of vertices in contact are used.
        outward: The object's unit normals there, shape (V, 3).
        tolerance: Largest distance that counts as contact [m].

    Raises:
        InputError: Shapes that do not fit, or a tolerance below 0.
    """
    count = len(vertices)
    for name, array, shape in (
        ("parts", parts, (count,)),
        ("distances", distances, (count,)),
        ("nearest", nearest, (count, 3)),
        ("outward", outward, (count, 3)),
    ):
        if array.shape != shape:
            raise InputError(f"{name}: want shape {shape}, got {array.shape}")
    if not tolerance >= 0.0:
        raise InputError(f"tolerance: want a distance ≥ 0 [m], got {tolerance!r}")
    share = vertex_areas(vertices, faces)
    skin = vertex_normals(vertices, faces).astype(np.float64)
    touching = (distances <= tolerance) & (parts >= 0)
    rows = []
    for part in np.unique(parts[touching]).tolist():
        own = np.flatnonzero(touching & (parts == part))
        weight = share[own] / max(share[own].sum(), 1e-300)
        inward, facing = -weight @ outward[own], weight @ skin[own]
        lengths = np.linalg.norm(inward), np.linalg.norm(facing)
        if min(lengths) < 1e-6:
            continue
        place = weight @ np.asarray(nearest[own], dtype=np.float64)
        rows.append((names[part], place, inward / lengths[0], facing / lengths[1], share[own].sum(), len(own)))
    columns = list(zip(*rows, strict=True)) or [()] * 6
    return ContactPatches(
        tuple(columns[0]),
        np.array(columns[1], dtype=np.float64).reshape(-1, 3),
        np.array(columns[2], dtype=np.float64).reshape(-1, 3),
        np.array(columns[3], dtype=np.float64).reshape(-1, 3),
        np.array(columns[4], dtype=np.float64),
        np.array(columns[5], dtype=np.int64),
    )


def vertex_areas(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> Array:
    """Barycentric vertex areas: a third of the area of the triangles around each vertex [m²], shape (V,)."""
    a, b, c = (np.asarray(vertices, dtype=np.float64)[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), minlength=len(vertices)).astype(np.float64)
