"""A rig: a surface, the skeleton inside it, and what was found out on the way in."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.tree import Skeleton
from warpjld.surface import Surface

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
    """What a rig file, a surface with a skeleton file, or the built-in hand gives.

    Attributes:
        name: Short name, e.g. the file's stem.
        skeleton: Rest skeleton in canonical names, metres, Y up as in the file.
        surface: Rest surface in the skeleton's frame.
        skin: Painted weights, where the source has them.
        path: Source file, or None for a generated rig.
        source_joints: The source's own name of each joint ("" where a joint was added, as fingertips are).
        source_frames: Rest transforms of the source's joints to the world, shape (J, 4, 4): what its animations are
            relative to.
        notes: What was recognised, guessed, mended or looks suspicious, for people to read.
    """

    name: str
    skeleton: Skeleton
    surface: Surface
    skin: Skin | None = None
    path: Path | None = None
    source_joints: tuple[str, ...] = ()
    source_frames: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = field(default=())
