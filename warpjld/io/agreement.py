"""Faults of files that make no error, but of which nothing good comes: surfaces that are inside out, and skeletons that
are elsewhere than the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.geometry.inside_out import is_inside_out
from warpjld.io.source import SourceRig

__all__ = ["elsewhere", "outside_out"]

_SIZES = 10.0  # largest ratio of the sizes of skeleton and surface; a hand's with the whole arm's joints is 4


def outside_out(source: SourceRig) -> SourceRig:
    """The rig with its triangles turned over, and a note, if their volume is negative: they are wound clockwise."""
    if not is_inside_out(source.vertices, source.faces):
        return source
    return replace(
        source,
        faces=source.faces[:, ::-1].copy(),
        corner_uv=None if source.corner_uv is None else source.corner_uv[:, ::-1].copy(),
        notes=(*source.notes, "the surface is inside out: its triangles are turned over"),
    )


def elsewhere(source: SourceRig) -> tuple[str, ...]:
    """A warning if the joints are not where the surface is, or of quite another size."""
    used, joints = source.vertices[np.unique(source.faces)], source.tree.positions
    if not len(used) or len(joints) < 2:
        return ()
    sizes = [float(np.linalg.norm(np.ptp(points, axis=0))) for points in (used, joints)]
    if min(sizes) <= 0.0:
        return ()
    ratio = sizes[0] / sizes[1]
    if not 1.0 / _SIZES <= ratio <= _SIZES:
        return (
            f"the surface is {ratio:.3g} times as large as its skeleton: their units may differ; export the file with "
            "scales applied",
        )
    if (used.max(axis=0) < joints.min(axis=0)).any() or (joints.max(axis=0) < used.min(axis=0)).any():
        away = float(np.linalg.norm(used.mean(axis=0) - joints.mean(axis=0)))
        return (f"the surface lies {away:.3g} m beside its skeleton: export the file with transforms applied",)
    return ()
