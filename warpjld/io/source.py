"""What a rig file says, before anything is recognised in it: the common form every reader fills."""

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
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2), instead of ``uv`` where some vertex
            has several.
        parts: The file's meshes.
        polygons: Polygon of the file that each triangle is a part of, shape (S,), or None where all are triangles.
        joints: Influencing joints of ``tree`` per vertex, shape (W, K), or None where no skin is painted.
        weights: Their weights, rows summing to one, shape (W, K).
        axes: Flexion axes the file states, by joint number.
        limits: Channel limits [rad] the file states, by joint number then channel.
        initial: Angles of the rest pose [rad] the file states, by joint number then channel.
        placing: Similarity that brought vertices and joints from the file's units and axes to these, shape (4, 4).
        rigid: Joint of ``tree`` that a vertex follows rigidly (a mesh that hangs on a joint), -1 for flesh, shape
            (W,); None where all is flesh.
        metres: Metres a unit of length is, where the file says so.
        up: The file's up axis, ``y`` or ``z``, where it says so.
        placed: Whether an animator placed the joints: they stay where they are, none is merged, moved or added.
        stated: Joints of ``tree`` by canonical name, where the file itself says which is which.
        notes: What was mended on the way.
        suspicious: What is probably wrong, and what to do about it.
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
        """``stated`` by the file's own names, of several joints of one name the second as ``name#2``."""
        return {canonical: self.tree.own_name(joint) for canonical, joint in self.stated.items()}
