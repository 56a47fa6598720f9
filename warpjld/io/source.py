"""Raw content of a rig file before recognition: the common result of all readers."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.surface import Part
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["SourceRig"]


@dataclass(frozen=True, eq=False)
class SourceRig:
    """A surface with joints in the file's own names, order, units and axes.

    Attributes:
        path: The file.
        tree: Its joints.
        vertices: Rest positions, shape (W, 3).
        faces: Triangles, shape (S, 3).
        uv: Texture coordinates, shape (W, 2), or None.
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2), instead of ``uv`` if a vertex has
            several.
        parts: The file's meshes.
        polygons: Polygon of the file that each triangle is part of, shape (S,), or None if all are triangles.
        joints: Influencing joints of ``tree`` per vertex, shape (W, K), or None without painted weights.
        weights: Their weights, rows summing to one, shape (W, K).
        axes: Stated flexion axes, by joint index.
        limits: Stated channel limits [rad], by joint index, then channel.
        initial: Stated angles of the rest pose [rad], by joint index, then channel.
        placing: Similarity from the file's units and axes to those of this object, shape (4, 4).
        rigid: Joint of ``tree`` that a vertex follows rigidly (a mesh parented to a joint), -1 if deformable, shape
            (W,); None if all are deformable.
        metres: The file's unit of length [m], or None if not stated.
        up: The file's up axis, ``y`` or ``z``, or None if not stated.
        placed: Whether the joints were placed by hand: none is merged, moved or added.
        stated: Joints of ``tree`` by canonical name, if the file itself states them.
        notes: Repairs, for the user.
        suspicious: Probable errors, each with a remedy.
    """

    path: Path
    tree: SourceTree
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float32] | None = None
    corner_uv: NDArray[np.float32] | None = None
    parts: tuple[Part, ...] = ()
    polygons: NDArray[np.int64] | None = None
    joints: NDArray[np.int64] | None = None
    weights: NDArray[np.float64] | None = None
    axes: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    limits: dict[int, dict[str, tuple[float, float]]] = field(default_factory=dict)
    initial: dict[int, dict[str, float]] = field(default_factory=dict)
    placing: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    rigid: NDArray[np.int64] | None = None
    metres: float | None = None
    up: str | None = None
    placed: bool = False
    stated: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    suspicious: tuple[str, ...] = ()

    def stated_names(self) -> dict[str, str]:
        """``stated`` with the file's joint names; the second of several with the same name as ``name#2``."""
        return {canonical: self.tree.own_name(joint) for canonical, joint in self.stated.items()}
