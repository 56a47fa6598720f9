"""What contact puts on the muscles of a hand, from an equilibrium (R118)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.bone_loads import loads_from_contact
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.press.bodies import Bodies, HandBody
from warpjld.skeleton import Poses

__all__ = ["effort_at"]


def effort_at(
    bodies: Bodies,
    hand: HandBody,
    poses: Poses,
    displacement: NDArray[np.float64],
    nodal: NDArray[np.float64],
    limits: Mapping[str, float] | None = None,
) -> Effort:
    """Compare what contact puts on the bones with what muscles can do.

    Bent joints strain their own flesh, which is not the muscles' concern: contact alone is counted.

    Args:
        bodies: Everything.
        hand: Whose.
        poses: One pose of it.
        displacement: Of all nodes [m], shape (N, 3).
        nodal: Contact forces of each pair [N], shape (P, N, 3).
        limits: Digit → largest force [N], where it is not the default.
    """
    span = bodies.spans[hand.name]
    loads = loads_from_contact(hand.part.hand, displacement[span], nodal.sum(axis=0)[span])
    return effort_of(hand.drive.skeleton, poses, loads, limits=limits)
