"""Where an object can be taken between thumb and fingers: pairs of points opposite to one another on its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject

__all__ = ["Widths", "sample_widths"]

_SURFACE = 1e-5  # a point this near lies on the surface [m]
_LEAN = 0.4  # how far a line may lean from the normal it starts along, as a tangent


@dataclass(frozen=True, eq=False)
class Widths:
    """N pairs of points of an object's surface, on the stage.

    Attributes:
        first: Where lines enter [m], shape (N, 3).
        second: Where they leave, shape (N, 3).
        slant: Cosine of the larger angle between a line and the normals at its ends, shape (N,).
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
    """Draw points evenly over an object's surface and look for the point opposite to each.

    A line goes into the object along the normal, leaning a little at random, and is followed by steps of the distance
    itself (Hart 1996) until it leaves. Lines longer than ``widest`` [m] are dropped.
    """
    thing = near.thing
    corner = thing.vertices[thing.faces]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    face = rng.choice(len(area), size=count, p=area / area.sum())
    local = np.einsum("nk,nki->ni", rng.dirichlet([1.0, 1.0, 1.0], size=count), corner[face])
    outward = thing.normals[face]
    line = -outward + rng.uniform(-_LEAN, _LEAN, size=(count, 3)) * rng.uniform(size=(count, 1))
    line = unit(line)
    along = np.full(count, 20.0 * _SURFACE)
    left, normal = np.zeros(count, dtype=bool), np.zeros((count, 3))
    for _ in range(64):
        going = np.flatnonzero(~left & (along < widest))
        if not len(going):
            break
        found = near.objects.distances(local[going] + along[going, None] * line[going], threads=1)
        depth = -found.distance[0]
        out = depth < _SURFACE
        left[going[out]] = True
        normal[going[out]] = thing.normals[found.face[0][out]]
        along[going] += np.where(out, 0.0, depth)
    slant = np.minimum(-(outward * line).sum(axis=1), (normal * line).sum(axis=1))
    # what leaves at once started at an edge and says nothing
    good = left & (slant > 0.0) & (along > 100.0 * _SURFACE)
    first, second = (thing.place.apply(ends[good])[0] for ends in (local, local + along[:, None] * line))
    return Widths(first, second, slant[good])
