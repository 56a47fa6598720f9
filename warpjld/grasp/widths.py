"""Antipodal point pairs ("widths") of an object's surface, where it can be taken between thumb and fingers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.device import shared_on
from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject

__all__ = ["Widths", "sample_widths"]

_SURFACE = 1e-5  # distance below which a point is on the surface [m]
_STEPS = 64  # largest number of steps along a line
_LEAN = 0.4  # largest deviation of a line from the normal at its start, per axis, as a tangent


@dataclass(frozen=True, eq=False)
class Widths:
    """N pairs of points on an object's surface, in world space.

    Attributes:
        first: Points where lines enter the object [m], shape (N, 3).
        second: Points where they leave it [m], shape (N, 3).
        slant: Cosine of the larger of the angles between a line and the normals at its ends, shape (N,).
    """

    first: NDArray[np.float64]
    second: NDArray[np.float64]
    slant: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.first)

    def __getitem__(self, rows: NDArray) -> Widths:
        return Widths(self.first[rows], self.second[rows], self.slant[rows])

    @property
    def width(self) -> NDArray[np.float64]:
        """Distance of the points [m], shape (N,)."""
        return np.asarray(np.linalg.norm(self.second - self.first, axis=1))


def sample_widths(near: NearObject, count: int, rng: np.random.Generator, *, widest: float) -> Widths:
    """Draw points uniformly over an object's surface and find the point opposite to each.

    A line enters the object along the negative normal, randomly tilted, and is followed by sphere tracing (Hart 1996)
    until it leaves.

    Args:
        near: The object.
        count: Number of lines; fewer pairs are returned.
        rng: Source of random numbers.
        widest: Lines that do not leave within this length are dropped [m].
    """
    thing = near.thing
    corner = thing.vertices[thing.faces]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    face = rng.choice(len(area), size=count, p=area / area.sum())
    local = np.einsum("nk,nki->ni", rng.dirichlet([1.0, 1.0, 1.0], size=count), corner[face])
    outward = thing.normals[face]
    line = -outward + rng.uniform(-_LEAN, _LEAN, size=(count, 3)) * rng.uniform(size=(count, 1))
    line = unit(line)
    along, leaves = _followed(near, local, line, widest)
    left = leaves >= 0
    normal = thing.normals[leaves]
    slant = np.minimum(-(outward * line).sum(axis=1), (normal * line).sum(axis=1))
    # a line that leaves at once started at an edge: not a width of the object
    good = left & (slant > 0.0) & (along > 100.0 * _SURFACE)
    first, second = (thing.place.apply(ends[good])[0] for ends in (local, local + along[:, None] * line))
    return Widths(first, second, slant[good])


def _followed(
    near: NearObject, start: NDArray[np.float64], line: NDArray[np.float64], widest: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Length of lines until they leave the object [m], and the triangles where they do, −1 where they do not, (n,)."""
    import warp as wp
    from warpjld_kernels.lines_to_object import follow_through

    along, leaves = np.full(len(start), 20.0 * _SURFACE), np.empty(len(start), dtype=np.int32)
    given: list[tuple[NDArray, Any]] = [(start, wp.vec3d), (line, wp.vec3d), (along, wp.float64), (leaves, wp.int32)]
    arrays = [shared_on(near.device, values, kind) for values, kind in given]
    inputs = [near.objects.solids, *arrays[:2], _SURFACE, widest, _STEPS, *arrays[2:]]
    wp.launch(follow_through, len(start), inputs=inputs, device=near.device)
    return arrays[2].numpy(), arrays[3].numpy()
