"""Built-in hands stored in files: building one takes seconds, reading it a few hundredths of a second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.files.kept_values import hash_of, kept_value
from warpjld.hand.build import build_hand, hand_rig
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["kept_hand"]

_MODULES = ("*.py", "files/*.py", "geometry/*.py", "hand/*.py", "rig/*.py", "runtime/*.py", "skeleton/**/*.py")
"""Program files that building a hand executes."""


@dataclass(frozen=True, eq=False)
class _Built:
    """Stored data of a built-in hand's rig."""

    skeleton: Skeleton
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]


def kept_hand(side: str = "left", **options: Any) -> Rig:
    """``build_hand``, read from a file where the same hand was built before.

    Args:
        side: As of ``build_hand``, likewise ``options``.
    """

    def build() -> _Built:
        rig = build_hand(side, **options)
        return _Built(rig.skeleton, rig.surface.vertices, rig.surface.faces)

    built, _ = kept_value(
        "hand", hash_of(side, dict(sorted(options.items()))), (_Built, Skeleton), build, modules=_MODULES
    )
    return hand_rig(side, built.skeleton, built.vertices, built.faces)
