"""What drives the bones of a hand: the animation over time, or other angles where a search asks for them (R110)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.skeleton import Poses, Skeleton

__all__ = ["Drive"]


class Drive:
    """Joint angles, poses and motions of bones.

    Args:
        hand: The flesh, whose bones move.
        skeleton: As the script has it, limits included.
        pose: One pose at a time, as the animation has it.
        angles: Joint angles at a time [rad], shape (J, 4); None for a motion that has none.
        posed: One pose for other angles (J, 4) at a time.
    """

    def __init__(
        self,
        hand: FleshHand,
        skeleton: Skeleton,
        pose: Callable[[float], Poses],
        angles: Callable[[float], NDArray[np.float64]] | None = None,
        posed: Callable[[NDArray[np.float64], float], Poses] | None = None,
    ) -> None:
        self.hand = hand
        self.skeleton = skeleton
        self.pose = pose
        self.angles = angles
        self.posed = posed
        self._moves = lru_cache(maxsize=8)(lambda time: hand.moves(pose(time)))

    @property
    def bendable(self) -> bool:
        """Whether the joints have angles that a search may change."""
        return self.angles is not None and self.posed is not None

    def moves(self, time: float) -> Moves:
        """Motions of the bones from the rig's rest, as the animation has them."""
        return self._moves(time)

    def moves_of(self, angles: NDArray[np.float64], time: float) -> Moves:
        """Motions of the bones at other angles (J, 4)."""
        assert self.posed is not None
        return self.hand.moves(self.posed(angles, time))

    def changed(self) -> None:
        """The animation has other keys than before."""
        self._moves.cache_clear()
