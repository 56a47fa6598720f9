"""What moves over time as a simulation asks for it: actors with joints and skin, and objects; and edits laid over it.

Times are frame numbers, whole or not. A script's actors and objects implement these protocols, and so do arrays
(``warpjld.simulation.recorded``): a simulation knows of nothing behind them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.fem.contact import Obstacle
    from warpjld.grasp import GraspObject, Places
    from warpjld.rig import Rig
    from warpjld.skeleton import Poses, Skeleton

__all__ = ["ActorAnimation", "AngleEdit", "Animation", "ObjectAnimation"]


@dataclass(frozen=True)
class AngleEdit:
    """One joint that flexes otherwise than the animation has it.

    Attributes:
        actor: Whose.
        joint: As the skeleton numbers it.
        kept: Frame up to which all stays as it is.
        frame: Frame at which the joint flexes by ``value``; None: wherever it holds, after ``kept``, the angle it has
            there.
        value: Flexion [rad].
    """

    actor: str
    joint: int
    kept: float
    frame: float | None
    value: float


class ActorAnimation(Protocol):
    """A rig that moves."""

    @property
    def name(self) -> str:
        """Of the actor."""
        ...

    @property
    def rig(self) -> Rig:
        """Surface and skeleton at rest; flexion axes and limits as they hold in the animation."""
        ...

    @property
    def skeleton(self) -> Skeleton:
        """That of the rig."""
        ...

    @property
    def covering(self) -> Covering:
        """Its skin bound to its skeleton."""
        ...

    @property
    def bendable(self) -> bool:
        """Whether its joints have angles, which a search or a correction may change."""
        ...

    def pose(self, frame: float) -> Poses:
        """One pose."""
        ...

    def angles(self, frame: float) -> NDArray[np.float64]:
        """Joint angles [rad], shape (J, 4); only where it is bendable."""
        ...

    def posed(self, angles: NDArray[np.float64], frame: float) -> Poses:
        """The pose of other angles (J, 4), its root as it is at a frame; only where it is bendable."""
        ...

    def skin(self, frame: float) -> NDArray[np.float64]:
        """Its surface as the covering has it [m], shape (V, 3)."""
        ...


class ObjectAnimation(Protocol):
    """An object on the stage."""

    @property
    def name(self) -> str:
        """Of the object."""
        ...

    @property
    def thing(self) -> GraspObject:
        """Its surface in its own frame, and where it stands at first."""
        ...

    def place(self, frame: float) -> Places:
        """One placement."""
        ...

    def obstacle(self, start: float) -> Obstacle:
        """It as something that does not give way; the obstacle's time is in frames from ``start``."""
        ...


class Animation(Protocol):
    """All that moves, by name; no actor and object of one name."""

    @property
    def actors(self) -> Mapping[str, ActorAnimation]:
        """In their order on the stage."""
        ...

    @property
    def objects(self) -> Mapping[str, ObjectAnimation]:
        """In their order on the stage."""
        ...

    def edited(self, edits: Sequence[AngleEdit]) -> Animation:
        """The same with edits laid over its actors, which are bendable; what does not change stays the same object."""
        ...
