"""Protocols of the animation that a simulation samples (actors with joints and skin, objects), and edits of it.

Times are frame numbers and may be fractional. The actors and objects of a script implement these protocols, and so do
those made of arrays (``warpjld.simulation.recorded``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.channels import FLEXION

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.fem.contact import Obstacle
    from warpjld.grasp import GraspObject, Places
    from warpjld.rig import Rig
    from warpjld.skeleton import Poses, Skeleton

__all__ = ["ActorAnimation", "AngleEdit", "Animation", "ObjectAnimation"]


@dataclass(frozen=True)
class AngleEdit:
    """Change of one angle of a joint relative to the animation.

    Attributes:
        actor: Name of the actor.
        joint: Index of the joint in its skeleton.
        kept: Last frame that the edit leaves unchanged.
        frame: Frame at which the angle is ``value``; None: every frame after ``kept`` whose angle equals the one at
            ``kept``.
        value: The angle [rad].
        channel: Which angle, as in ``CHANNELS``; flexion by default.
    """

    actor: str
    joint: int
    kept: float
    frame: float | None
    value: float
    channel: int = FLEXION


class ActorAnimation(Protocol):
    """An animated rig."""

    @property
    def name(self) -> str:
        """Name of the actor."""
        ...

    @property
    def rig(self) -> Rig:
        """Surface and skeleton at rest, with the flexion axes and limits that the animation uses."""
        ...

    @property
    def skeleton(self) -> Skeleton:
        """Skeleton of the rig."""
        ...

    @property
    def covering(self) -> Covering:
        """Binding of its skin to its skeleton."""
        ...

    @property
    def bendable(self) -> bool:
        """Whether it is driven by joint angles, which searches and corrections may change."""
        ...

    def pose(self, frame: float) -> Poses:
        """Pose at a frame (a batch of one)."""
        ...

    def angles(self, frame: float) -> NDArray[np.float64]:
        """Joint angles at a frame [rad], shape (J, 4); only if it is bendable."""
        ...

    def posed(self, angles: NDArray[np.float64], frame: float) -> Poses:
        """Pose of given joint angles (J, 4), with the root of a frame; only if it is bendable."""
        ...

    def skin(self, frame: float) -> NDArray[np.float64]:
        """Surface deformed by the covering at a frame [m], shape (V, 3)."""
        ...


class ObjectAnimation(Protocol):
    """An animated object."""

    @property
    def name(self) -> str:
        """Name of the object."""
        ...

    @property
    def thing(self) -> GraspObject:
        """Its surface in its own frame, with its initial placement."""
        ...

    def place(self, frame: float) -> Places:
        """Placement at a frame (a batch of one)."""
        ...

    def obstacle(self, start: float) -> Obstacle:
        """The object as a rigid obstacle; times of the obstacle are in frames from ``start``."""
        ...


class Animation(Protocol):
    """Actors and objects by name; names are unique across both."""

    @property
    def actors(self) -> Mapping[str, ActorAnimation]:
        """Actors in scene order."""
        ...

    @property
    def objects(self) -> Mapping[str, ObjectAnimation]:
        """Objects in scene order."""
        ...

    def edited(self, edits: Sequence[AngleEdit]) -> Animation:
        """A copy with edits applied to its (bendable) actors; whatever does not change remains the same instance."""
        ...
