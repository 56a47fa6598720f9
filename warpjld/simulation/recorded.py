"""Animation made of arrays: poses or joint angles of actors and placements of objects, one row per frame.

Rows are interpolated linearly; before the first and after the last row values are constant.
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
from warpjld.simulation.bodies.obstacle import placed_motion, rigid_obstacle
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles
from warpjld.skeleton.between import poses_between

__all__ = ["RecordedActor", "RecordedAnimation", "RecordedObject"]


def _between(rows: NDArray[np.float64], at: float) -> NDArray[np.float64]:
    """Linear interpolation of rows (F, …) at a fractional row index, clamped to the ends."""
    at = float(np.clip(at, 0.0, len(rows) - 1.0))
    before = int(at)
    after, part = min(before + 1, len(rows) - 1), at - before
    return np.asarray((1.0 - part) * rows[before] + part * rows[after])


class RecordedActor:
    """A rig animated by an array of poses or joint angles, one row per frame from ``first`` on.

    Args:
        name: Name of the actor.
        rig: Surface and skeleton.
        poses: F poses of its skeleton.
        angles: Joint angles instead of poses [rad], shape (F, J, 4), channels as in ``CHANNELS``; searches and
            corrections may change them.
        root: With angles: displacement of the root from rest [m], shape (F, 3) or (3,).
        covering: Binding of its skin to its skeleton; made on first use if left out.
        first: Frame of the first row.

    Raises:
        InputError: Neither or both of poses and angles, a wrong shape, or values that are not finite.

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
            raise InputError("poses, angles: want exactly one of the two")
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
        """Skeleton of the rig."""
        return self.rig.skeleton

    @cached_property
    def covering(self) -> Covering:
        """Binding of its skin to its skeleton."""
        return self._covering or bind_rig(self.rig)

    @property
    def bendable(self) -> bool:
        """Whether it is driven by joint angles."""
        return self._angles is not None

    def pose(self, frame: float) -> Poses:
        """Pose at a frame (a batch of one)."""
        if self._poses is not None:
            return poses_between(self._poses, np.array([frame - self._first]))
        return self.posed(self.angles(frame), frame)

    def angles(self, frame: float) -> NDArray[np.float64]:
        """Joint angles at a frame [rad], shape (J, 4)."""
        assert self._angles is not None
        return _between(self._angles, frame - self._first)

    def posed(self, angles: NDArray[np.float64], frame: float) -> Poses:
        """Pose of given joint angles (J, 4), with the root of a frame."""
        root = _between(self._root, frame - self._first)
        return poses_from_angles(self.rig.skeleton, angles[None], root_position=root[None])

    def skin(self, frame: float) -> NDArray[np.float64]:
        """Surface deformed by the covering at a frame [m], shape (V, 3)."""
        return self.covering.deform(self.pose(frame))[0].astype(np.float64)

    def edited(self, edits: Sequence[AngleEdit]) -> RecordedActor:
        """A copy with edits applied to its rows of angles."""
        assert self._angles is not None
        angles, frames = self._angles.copy(), self._first + np.arange(len(self._angles))
        for edit in edits:
            column = angles[:, edit.joint, edit.channel]
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
    """An object with an array of placements, one row per frame from ``first`` on; one row for an object at rest.

    Attributes:
        name: Name of the object.
        surface: Its surface in its own frame [m]: a ``trimesh.Trimesh``, or a ``GraspObject`` from ``shapes`` or a
            file.
        positions: Position of its origin [m], shape (F, 3) or (3,).
        rotations: Unit quaternions x, y, z, w, shape (F, 4) or (4,).
        first: Frame of the first row.

    Raises:
        InputError: Wrong shapes, or an invalid surface.

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
        """Its surface, with its initial placement."""
        thing = self.surface
        if not isinstance(thing, GraspObject):
            thing = make_object(self.name, np.asarray(thing.vertices, np.float64), np.asarray(thing.faces, np.int32))
        return replace(thing, place=self._places[:1])

    def place(self, frame: float) -> Places:
        """Placement at a frame (a batch of one)."""
        at, places = frame - self.first, self._places
        turns = places.rotation
        ends = np.clip([np.floor(at), np.floor(at) + 1.0], 0, len(places) - 1).astype(int)
        if turns[ends[0]] @ turns[ends[1]] < 0.0:
            turns = turns * np.where(np.arange(len(places)) == ends[1], -1.0, 1.0)[:, None]
        return Places.of(_between(places.position, at), _between(turns, at))

    def obstacle(self, start: float) -> Obstacle:
        """The object as a rigid obstacle; times of the obstacle are in frames from ``start``."""
        return rigid_obstacle(self.thing, placed_motion(self.place, start))


class RecordedAnimation:
    """Animation of actors and objects made of arrays.

    Args:
        actors: Actors with unique names.
        objects: Objects with unique names, different from those of the actors.

    Raises:
        InputError: A name is used twice.

    Examples:
        >>> stage = wj.RecordedAnimation(objects=[wj.RecordedObject("ball", wj.shapes.ball(0.06))])
        >>> list(stage.objects)
        ['ball']
    """

    def __init__(self, actors: Iterable[RecordedActor] = (), objects: Iterable[RecordedObject] = ()) -> None:
        people, things = list(actors), list(objects)
        self.actors = {actor.name: actor for actor in people}
        self.objects = {thing.name: thing for thing in things}
        if len({*self.actors, *self.objects}) < len(people) + len(things):
            raise InputError("actors, objects: want a name of its own for each")

    def __repr__(self) -> str:
        return (
            f"RecordedAnimation(actors {', '.join(self.actors) or 'none'}; objects {', '.join(self.objects) or 'none'})"
        )

    def edited(self, edits: Sequence[AngleEdit]) -> RecordedAnimation:
        """A copy with edits applied to its actors."""
        out = RecordedAnimation(objects=self.objects.values())
        for name, actor in self.actors.items():
            mine = [edit for edit in edits if edit.actor == name]
            out.actors[name] = actor.edited(mine) if mine else actor
        return out
