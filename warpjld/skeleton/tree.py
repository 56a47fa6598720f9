"""The rest skeleton: joint tree, rest positions, flexion axes and limits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, rotate, unit
from warpjld.skeleton.channels import CHANNELS, channel_rotations
from warpjld.suggest import did_you_mean

__all__ = ["ALONG", "CHANNELS", "Segment", "Skeleton"]

ALONG = 0.1
"""Sine of the angle to a joint's own segment below which an axis is no flexion axis but a twist axis (R20)."""


@dataclass(frozen=True)
class Segment:
    """A bone between two joints; it moves with the rotation of its proximal joint.

    Attributes:
        proximal: Joint nearer to the root.
        distal: Joint at the other end; it identifies the segment.
        palm: Whether the two-segment covering of the palm applies (R19).
    """

    proximal: int
    distal: int
    palm: bool


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A rest skeleton of J joints, parents before children (R1, R6, R24).

    Every joint carries one rigid bone, whose rotation is measured from the rest pose; so at rest all rotations
    are the identity whatever frames the source file gave its bones.

    Attributes:
        names: Canonical joint names, e.g. ``left.index.base``; those not recognised keep the file's name.
        parents: Parent joint, -1 for the root, shape (J,).
        rest: Joint positions at rest [m], shape (J, 3).
        axes: Unit flexion axes at rest, shape (J, 3). Positive flexion bends towards the palm: the normal
            segment × axis points to the external side (R20).
        limits: Smallest and largest angle [rad] of each channel, shape (J, 4, 2), channels as in ``CHANNELS``.
        palms: Per hand its palm segments as (proximal, distal) pairs, ulnar to radial; neighbours are adjacent.
        initial: Angles of the rest pose, counted from straight joints [rad], shape (J, 4) (R25): the values of all
            angles that no motion sets. Zero by default.

    Examples:
        >>> skeleton = wj.build_hand("left", resolution=1500).skeleton
        >>> skeleton
        Skeleton(26 joints, root 'left.forearm')
        >>> skeleton.index("index.base") == skeleton.names.index("left.index.base")
        True
    """

    names: tuple[str, ...]
    parents: NDArray[np.int32]
    rest: NDArray[np.float64]
    axes: NDArray[np.float64]
    limits: NDArray[np.float64]
    palms: tuple[tuple[tuple[int, int], ...], ...] = ()
    initial: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, len(CHANNELS))))

    def __post_init__(self) -> None:
        count = len(self.names)
        if not len(self.initial):
            object.__setattr__(self, "initial", np.zeros((count, len(CHANNELS))))
        wants = {
            "parents": (count,),
            "rest": (count, 3),
            "axes": (count, 3),
            "limits": (count, len(CHANNELS), 2),
            "initial": (count, len(CHANNELS)),
        }
        for what, shape in wants.items():
            array = getattr(self, what)
            if array.shape != shape:
                raise InputError(f"skeleton {what}: want shape {shape}, got {array.shape}")
            if not np.isfinite(array).all():
                bad = int(np.argwhere(~np.isfinite(array))[0][0])
                raise InputError(f"skeleton {what}: joint '{self.names[bad]}' is not finite")
        if len(set(self.names)) != count:
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise InputError(f"skeleton: two joints are called '{twice}'")
        late = np.flatnonzero(self.parents >= np.arange(count))
        if late.size:
            raise InputError(f"skeleton: parent of '{self.names[late[0]]}' does not come before it")

    def __repr__(self) -> str:
        return f"Skeleton({len(self)} joints, root '{self.names[0]}')"

    def __len__(self) -> int:
        return len(self.names)

    def index(self, name: str) -> int:
        """Joint index of a canonical name; the side may be left out where only one side has it.

        Raises:
            InputError: There is no such joint, or more than one.
        """
        wanted = name.lower()
        matches = [
            i for i, n in enumerate(self.names) if n == wanted or (n.partition(".")[2] == wanted and n[:5] in _SIDED)
        ]
        exact = [i for i in matches if self.names[i] == wanted]
        if len(exact or matches) == 1:
            return (exact or matches)[0]
        if matches:
            raise InputError(f"joint '{name}' is ambiguous: {', '.join(self.names[i] for i in matches)}")
        raise InputError(f"no joint '{name}' in this skeleton{_similar(wanted, self.names)}")

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """One segment per joint that has a parent, in joint order; palm segments are marked."""
        palm = {distal: proximal for pairs in self.palms for proximal, distal in pairs}
        return tuple(
            Segment(palm.get(j, int(self.parents[j])), j, j in palm) for j in range(len(self)) if self.parents[j] >= 0
        )

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """Children of every joint."""
        return tuple(tuple(int(c) for c in np.flatnonzero(self.parents == j)) for j in range(len(self)))

    @cached_property
    def directions(self) -> NDArray[np.float64]:
        """Unit rest direction of each joint's bone, shape (J, 3): to the child, or the mean of those to the children;
        at an extremity that of the segment that ends there."""
        out = np.zeros((len(self), 3))
        for j in range(len(self)):
            kids = [c for c in self.children[j] if np.linalg.norm(self.rest[c] - self.rest[j]) > 1e-9]
            if kids:
                towards = sum(self.rest[c] - self.rest[j] for c in kids)
                if np.linalg.norm(towards) < 1e-9:
                    towards = self.rest[kids[0]] - self.rest[j]
            elif self.parents[j] >= 0:
                towards = self.rest[j] - self.rest[self.parents[j]]
            else:
                towards = np.array([0.0, 1.0, 0.0])
            length = np.linalg.norm(towards)
            out[j] = towards / length if length > 1e-9 else out[max(self.parents[j], 0)]
        return out

    @cached_property
    def mirror(self) -> NDArray[np.float64]:
        """-1 for joints of the left side, else +1, shape (J,): sign of rotations that are mirrored between sides."""
        return np.array([-1.0 if name.startswith("left.") else 1.0 for name in self.names])

    @cached_property
    def initial_turns(self) -> NDArray[np.float64] | None:
        """Rotation of every bone from its joint's straight position to rest, relative to the parent's bone,
        quaternions x, y, z, w, shape (J, 4); None where all joints are straight at rest.

        In the axes of the rest pose; these and the straight joint's axes give the same quaternion.
        """
        if not self.initial.any():
            return None
        return channel_rotations(self.initial, self.axes, self.directions, self.mirror[:, None])

    @cached_property
    def straight(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unit directions and flexion axes of bones whose joint is straight and whose parent is at rest, shapes
        (J, 3)."""
        if self.initial_turns is None:
            return self.directions, self.axes
        back = conjugate(self.initial_turns)
        return rotate(back, self.directions), rotate(back, self.axes)

    @cached_property
    def levels(self) -> tuple[tuple[NDArray[np.int64], NDArray[np.int32]], ...]:
        """Joints and their parents by depth in the tree, roots first: all of a level can be computed at once."""
        depth = np.zeros(len(self), dtype=np.int64)
        for j, parent in enumerate(self.parents.tolist()):
            depth[j] = depth[parent] + 1 if parent >= 0 else 0
        levels = (np.flatnonzero(depth == d) for d in range(int(depth.max(initial=-1)) + 1))
        return tuple((joints, self.parents[joints]) for joints in levels)

    @cached_property
    def normals(self) -> NDArray[np.float64]:
        """Segment × flexion axis, which points to the external side, shape (J, 3) (R20)."""
        return np.cross(self.directions, self.axes)

    @cached_property
    def bending_planes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Plane in which the vertical flexion of every joint is measured (R28).

        Returns:
            Straight direction in the plane normal to the unpivoted axis, and the direction of flexion from there, unit
            vectors, shapes (J, 3); mask of the joints that have such a plane, shape (J,).
        """
        straight, axes = self.straight
        initial = straight - axes * (axes * straight).sum(axis=1, keepdims=True)
        length = np.linalg.norm(initial, axis=1, keepdims=True)
        bends = length[:, 0] >= 1e-6  # elsewhere the axis lies along the segment
        initial = initial / np.where(length >= 1e-6, length, 1.0)
        return initial, np.cross(axes, initial), bends

    def with_axes(self, axes: NDArray[np.float64]) -> Skeleton:
        """The same skeleton with other flexion axes (R21)."""
        return replace(self, axes=unit(axes))


_SIDED = ("left.", "right")


def _similar(word: str, names: tuple[str, ...]) -> str:
    return did_you_mean(word, [*names, *(n.partition(".")[2] for n in names if n[:5] in _SIDED)])
