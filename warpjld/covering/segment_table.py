"""Geometry of the segments at rest, and projection of points on them (A §4, R34–R39)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.tree import Skeleton

__all__ = ["SNAP", "SegmentTable"]

SNAP = 1e-9
"""Ratios, and heights relative to the surface's size, that differ by less count as equal, so that rounding, which
differs between processors, decides nothing."""


@dataclass(frozen=True, eq=False)
class SegmentTable:
    """S segments at rest.

    Attributes:
        ends: Proximal and distal joint, shape (S, 2).
        start: Position of the proximal joint [m], shape (S, 3).
        along: Vector from there to the distal joint [m], shape (S, 3).
        normals: Unit y axes at the proximal and distal joint, shape (S, 2, 3) (R20).
        open_end: Whether it ends in an extremity, where the ratio may exceed 1, shape (S,).
        open_start: Whether it begins at a root, where the ratio may fall below 0, shape (S,).
    """

    ends: NDArray[np.int32]
    start: NDArray[np.float64]
    along: NDArray[np.float64]
    normals: NDArray[np.float64]
    open_end: NDArray[np.bool_]
    open_start: NDArray[np.bool_]

    @staticmethod
    def build(skeleton: Skeleton, ends: NDArray[np.int32]) -> SegmentTable:
        """Table of the segments between these proximal and distal joints, shape (S, 2)."""
        start = skeleton.rest[ends[:, 0]]
        along = skeleton.rest[ends[:, 1]] - start
        direction = unit(along)
        normals = np.stack([np.cross(direction, skeleton.axes[ends[:, k]]) for k in (0, 1)], axis=1)
        lengths = np.linalg.norm(normals, axis=2, keepdims=True)
        # a flexion axis along the segment gives no normal: use the other end's, or any perpendicular
        normals = np.where(lengths > 1e-3, normals / np.maximum(lengths, 1e-30), normals[:, ::-1])
        # rounded, so that of two coordinate axes equally far from the segment the first is taken
        fallback = np.cross(direction, np.eye(3)[np.abs(direction).round(6).argmin(axis=1)])
        lengths = np.linalg.norm(normals, axis=2, keepdims=True)
        normals = np.where(lengths > 1e-3, normals / np.maximum(lengths, 1e-30), fallback[:, None, :])
        leaf = np.array([not skeleton.children[d] for d in ends[:, 1]])
        root = np.array([skeleton.parents[p] < 0 for p in ends[:, 0]])
        return SegmentTable(ends, start, along, normals, leaf, root)

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ratio of every point on every segment, shape (V, S), clamped except beyond extremities (R37, C1)."""
        t = (points @ self.along.T - (self.start * self.along).sum(axis=1)) / (self.along**2).sum(axis=1)
        t = np.where(np.abs(t) < SNAP, 0.0, np.where(np.abs(t - 1.0) < SNAP, 1.0, t))
        t = np.where((t < 0.0) & ~self.open_start, 0.0, t)
        return np.where((t > 1.0) & ~self.open_end, 1.0, t)

    def heights(self, points: NDArray[np.float64], segments: NDArray[np.integer]) -> NDArray[np.float64]:
        """Height vector of each point over a segment, (offset · normal) normal [m], shape (n, 3) (R63).

        It is evaluated with the normal of each joint, and the results are interpolated: hip and knee bend in opposite
        senses, and half-way along a thigh an interpolated normal would vanish and flip.
        """
        along, start, normals = self.along[segments], self.start[segments], self.normals[segments]
        offset = points - start
        place = np.clip((offset * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        share = np.stack([1.0 - place, place], axis=1)
        height = np.einsum("nk,nek->ne", offset, normals)
        return np.asarray(np.einsum("ne,ne,nek->nk", share, height, normals))
