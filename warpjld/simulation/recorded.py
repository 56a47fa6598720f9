"""An animation made of arrays: poses or joint angles of actors, places of objects, one row a frame.

Between two rows everything goes straight from one to the other; before the first and after the last it stays.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering import Covering, bind_rig
from warpjld.errors import InputError
from warpjld.fem.contact import Obstacle
from warpjld.grasp import GraspObject, Places, make_object
from warpjld.rig import Rig
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.obstacle import rigid_obstacle
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles
from warpjld.skeleton.between import poses_between
from warpjld.skeleton.channels import FLEXION

__all__ = ["RecordedActor", "RecordedAnimation", "RecordedObject"]


def _between(rows: NDArray[np.float64], at: float) -> NDArray[np.float64]:
    """Rows (F, …) at a place between them."""
    at = float(np.clip(at, 0.0, len(rows) - 1.0))
    before = int(at)
    after, part = min(before + 1, len(rows) - 1), at - before
    return np.asarray((1.0 - part) * rows[before] + part * rows[after])


class RecordedActor:
    """A rig with an array of poses, or of joint angles, one row for each frame from ``first`` on.

    Args:
        name: Of the actor.
        rig: Surface and skeleton.
        poses: Final positions of its skeleton, F of them.
        angles: Joint angles instead [rad], shape (F, J, 4), channels as in ``CHANNELS``: searches and corrections may
            change them.
        root: With angles: displacement of the root from rest [m], shape (F, 3) or (3,).
        covering: Its skin bound to its skeleton; bound here where left out.
        first: Frame of the first row.

    Raises:
        InputError: Neither or both of poses and angles, or another shape.

    Examples:
        >>> import numpy as np
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> actor = wj.RecordedActor("hand", hand, angles=np.zeros((9, len(hand.skeleton), 4)))
        >>> actor.pose(4.0)
        Poses(1 frame of 26 joints)
    """

    def __init__(
        self,
        name: str,
        rig: Rig,
        *,
        poses: Poses | None = None,
        angles: ArrayLike | None = None,
        root: ArrayLike = (0.0, 0.0, 0.0),
        covering: Covering | None = None,
        first: float = 0.0,
    ) -> None:
        self.name, self.rig, self._first = name, rig, first
        if (poses is None) == (angles is None):
            raise InputError("poses, angles: want one of them")
        if poses is not None and (len(poses) < 1 or poses.positions.shape[1:] != (len(rig.skeleton), 3)):
            raise InputError(f"poses: want shape (F, {len(rig.skeleton)}, 3), got {poses.positions.shape}")
        self._poses = poses
        self._angles = None if angles is None else np.asarray(angles, dtype=np.float64)
        shape = (len(rig.skeleton), len(CHANNELS))
        if self._angles is not None:
            if self._angles.ndim != 3 or self._angles.shape[1:] != shape or not np.isfinite(self._angles).all():
                raise InputError(
                    f"angles: want finite ones of shape (F, {shape[0]}, {shape[1]}), got {self._angles.shape}"
                )
            at = np.asarray(root, dtype=np.float64)
            if at.shape not in ((3,), (len(self._angles), 3)) or not np.isfinite(at).all():
                raise InputError(f"root: want finite displacements (3,) or ({len(self._angles)}, 3), got {at.shape}")
            self._root = np.broadcast_to(at, (len(self._angles), 3))
        self._covering = covering

    def __repr__(self) -> str:
        rows = self._angles if self._poses is None else self._poses
        frames = 0 if rows is None else len(rows)
        return f"RecordedActor('{self.name}': {frames} frames from {self._first:g} on, {self.rig})"

    @property
    def skeleton(self) -> Skeleton:
        """That of the rig."""
        return self.rig.skeleton

    @cached_property
    def covering(self) -> Covering:
        """Its skin bound to its skeleton."""
        return self._covering or bind_rig(self.rig)

    @property
    def bendable(self) -> bool:
        """Whether it was given angles."""
        return self._angles is not None

    def pose(self, frame: float) -> Poses:
        """One pose."""
        if self._poses is not None:
            return poses_between(self._poses, np.array([frame - self._first]))
        return self.posed(self.angles(frame), frame)

    def angles(self, frame: float) -> NDArray[np.float64]:
        """Joint angles [rad], shape (J, 4)."""
        assert self._angles is not None
        return _between(self._angles, frame - self._first)

    def posed(self, angles: NDArray[np.float64], frame: float) -> Poses:
        """The pose of other angles (J, 4), its root as it is at a frame."""
        root = _between(self._root, frame - self._first)
        return poses_from_angles(self.rig.skeleton, angles[None], root_position=root[None])

    def skin(self, frame: float) -> NDArray[np.float64]:
        """Its surface as the covering has it [m], shape (V, 3)."""
        return self.covering.deform(self.pose(frame))[0].astype(np.float64)

    def edited(self, edits: Sequence[AngleEdit]) -> RecordedActor:
        """The same with other angles in the rows that edits are about."""
        assert self._angles is not None
        angles, frames = self._angles.copy(), self._first + np.arange(len(self._angles))
        for edit in edits:
            column = angles[:, edit.joint, FLEXION]
            if edit.frame is None:
                was = _between(column, edit.kept - self._first)
                column[(frames > edit.kept) & (column == was)] = edit.value
            else:
                column[frames == edit.frame] = edit.value
        return RecordedActor(
            self.name, self.rig, angles=angles, root=self._root, covering=self.covering, first=self._first
        )


@dataclass(frozen=True, eq=False)
class RecordedObject:
    """An object with an array of places, one row for each frame from ``first`` on; one row where it stands still.

    Attributes:
        name: Of the object.
        surface: Its surface in its own frame [m]: a ``trimesh.Trimesh``, or a ``GraspObject`` as shapes and files give.
        positions: Where its origin lies [m], shape (F, 3) or (3,).
        rotations: Unit quaternions x, y, z, w, shape (F, 4) or (4,).
        first: Frame of the first row.

    Raises:
        InputError: Other shapes, or a surface that is none.

    Examples:
        >>> thing = wj.RecordedObject("ball", wj.shapes.ball(0.06), positions=[[0, 0, 0], [0, 0.1, 0]])
        >>> thing.place(0.5).position.tolist()
        [[0.0, 0.05, 0.0]]
    """

    name: str
    surface: Any
    positions: ArrayLike = (0.0, 0.0, 0.0)
    rotations: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    first: float = 0.0

    def __post_init__(self) -> None:
        _ = self.thing

    def __repr__(self) -> str:
        return f"RecordedObject('{self.name}': {len(self._places)} places from frame {self.first:g} on, {self.thing})"

    @cached_property
    def _places(self) -> Places:
        return Places.of(self.positions, self.rotations)

    @cached_property
    def thing(self) -> GraspObject:
        """Its surface, standing where it is at first."""
        thing = self.surface
        if not isinstance(thing, GraspObject):
            thing = make_object(self.name, np.asarray(thing.vertices, np.float64), np.asarray(thing.faces, np.int32))
        return replace(thing, place=self._places[:1])

    def place(self, frame: float) -> Places:
        """One placement."""
        at, places = frame - self.first, self._places
        turns = places.rotation
        ends = np.clip([np.floor(at), np.floor(at) + 1.0], 0, len(places) - 1).astype(int)
        if turns[ends[0]] @ turns[ends[1]] < 0.0:
            turns = turns * np.where(np.arange(len(places)) == ends[1], -1.0, 1.0)[:, None]
        return Places.of(_between(places.position, at), _between(turns, at))

    def obstacle(self, start: float) -> Obstacle:
        """It as something that does not give way; the obstacle's time is in frames from ``start``."""

        def motion(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            here = self.place(start + time)
            return here.position[0], here.rotation[0]

        return rigid_obstacle(self.thing, motion)


class RecordedAnimation:
    """Actors and objects of arrays.

    Args:
        actors: Of different names.
        objects: Of different names, none that of an actor.

    Raises:
        InputError: Two of one name.

    Examples:
        >>> stage = wj.RecordedAnimation(objects=[wj.RecordedObject("ball", wj.shapes.ball(0.06))])
        >>> list(stage.objects)
        ['ball']
    """

    def __init__(self, actors: Iterable[RecordedActor] = (), objects: Iterable[RecordedObject] = ()) -> None:
        people, things = list(actors), list(objects)
        self.actors = {actor.name: actor for actor in people}
        self.objects = {one.name: one for one in things}
        if len({*self.actors, *self.objects}) < len(people) + len(things):
            raise InputError("actors, objects: want a name of its own for each")

    def __repr__(self) -> str:
        return (
            f"RecordedAnimation(actors {', '.join(self.actors) or 'none'}; objects {', '.join(self.objects) or 'none'})"
        )

    def edited(self, edits: Sequence[AngleEdit]) -> RecordedAnimation:
        """The same with edits laid over its actors."""
        out = RecordedAnimation(objects=self.objects.values())
        for name, actor in self.actors.items():
            mine = [edit for edit in edits if edit.actor == name]
            out.actors[name] = actor.edited(mine) if mine else actor
        return out
