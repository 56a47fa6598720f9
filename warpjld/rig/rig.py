"""A rig: a surface, the skeleton inside it, and the results of reading and recognition."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.surface import Surface
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.tree import Skeleton

__all__ = ["Rig", "Skin"]


@dataclass(frozen=True, eq=False)
class Skin:
    """Painted skin weights over the welded vertices.

    Attributes:
        joints: Influencing joints of the skeleton, shape (V, K).
        weights: Their weights, rows summing to one, shape (V, K).
    """

    joints: NDArray[np.int32]
    weights: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rig:
    """A surface with its skeleton, from a rig file, a surface and a skeleton file, or generated.

    Attributes:
        name: Short name, e.g. the file's stem.
        skeleton: Rest skeleton in canonical names, metres, Y up as in the file.
        surface: Rest surface in the skeleton's frame.
        skin: Painted weights, where the source has them.
        path: Source file, or None for a generated rig.
        source: The file's own joints, in its names, order, units and axes, which its animations move. None for a
            generated rig.
        sources: Joint of ``source`` that each joint of the skeleton is, -1 where it was added, as fingertips are.
        owner: Joint of the skeleton that each joint of ``source`` moves with, shape (N,); -1 for those above all
            recognised ones that carry no flesh, which do not move.
        placing: Similarity transform from the file's units and axes to the skeleton's, shape (4, 4).
        rigid: Joint of the skeleton that a welded vertex follows rigidly, -1 for flesh, shape (V,); None where all
            vertices are flesh.
        notes: Messages for the user about what was recognised, guessed or repaired.
        suspicious: Warnings for the user about probable errors and their remedies; every command prints them on
            stderr.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> hand.skeleton.names[:3], hand.surface.vertices.shape
        (('left.forearm', 'left.wrist', ...), (..., 3))
    """

    name: str
    skeleton: Skeleton
    surface: Surface
    skin: Skin | None = None
    path: Path | None = None
    source: SourceTree | None = None
    sources: tuple[int, ...] = ()
    owner: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    placing: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    rigid: NDArray[np.int32] | None = None
    notes: tuple[str, ...] = ()
    suspicious: tuple[str, ...] = ()

    def __repr__(self) -> str:
        counts = (
            f"{len(self.skeleton)} joints, {len(self.surface.vertices)} vertices, {len(self.surface.faces)} triangles"
        )
        doubts = f", {len(self.suspicious)} suspicious" if self.suspicious else ""
        return f"Rig('{self.name}': {counts}{doubts})"

    @property
    def source_joints(self) -> tuple[str, ...]:
        """The file's own name of every joint, "" where a joint was added; empty for a generated rig."""
        if self.source is None:
            return ()
        return tuple(self.source.names[j] if j >= 0 else "" for j in self.sources)
