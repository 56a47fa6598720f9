"""Altered rigs: other thickness, noise, other meshes, joints off their centres, other proportions, a bent rest pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pyvista as pv
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tests.benchmarks.skin.poses import pose
from tests.benchmarks.skin.rigs import BenchRig
from warpjld.covering.laplacian import uniform_laplacian
from warpjld.geometry.rotations import rotate
from warpjld.geometry.surface import weld_surface
from warpjld.rig import Rig, Skin

__all__ = ["ALTERATIONS"]

_SMOOTHING = 8  # averages over neighbours by which the change of thickness varies gently
_INFLUENCES = 8  # painted weights a vertex of a new mesh


def _altered(
    rig: Rig,
    vertices: NDArray[np.float64] | None = None,
    faces: NDArray[np.int32] | None = None,
    *,
    rest: NDArray[np.float64] | None = None,
    axes: NDArray[np.float64] | None = None,
) -> Rig:
    """The rig with other vertices (V, 3), triangles (T, 3), joints (J, 3) or axes (J, 3)."""
    moved = rig.surface.vertices if vertices is None else vertices
    surface = weld_surface(moved, rig.surface.faces if faces is None else faces)
    skeleton = rig.skeleton
    skeleton = replace(
        skeleton, rest=skeleton.rest if rest is None else rest, axes=skeleton.axes if axes is None else axes
    )
    skin = rig.skin if faces is None else _painted(rig, surface.vertices)
    return replace(rig, surface=surface, skeleton=skeleton, skin=skin, rigid=rig.rigid if faces is None else None)


def _painted(rig: Rig, vertices: NDArray[np.float64]) -> Skin | None:
    """The rig's painted weights at other vertices, from the three nearest of its own."""
    if rig.skin is None:
        return None
    weights = np.zeros((len(rig.surface.vertices), len(rig.skeleton)))
    np.add.at(weights, (np.arange(len(weights))[:, None], rig.skin.joints), rig.skin.weights)
    apart, nearest = cKDTree(rig.surface.vertices).query(vertices, k=3)
    share = 1.0 / np.maximum(apart, 1e-9) ** 2
    mixed = (weights[nearest] * (share / share.sum(axis=1, keepdims=True))[:, :, None]).sum(axis=1)
    joints = np.argsort(-mixed, axis=1)[:, :_INFLUENCES]
    chosen = np.take_along_axis(mixed, joints, axis=1)
    return Skin(joints.astype(np.int32), chosen / chosen.sum(axis=1, keepdims=True))


def _thicker(bench: BenchRig, factor: float) -> Rig:
    """Skin moved away from the nearest bone, or towards it."""
    rig = bench.rig
    vertices, skeleton = rig.surface.vertices, rig.skeleton
    away, apart = np.zeros_like(vertices), np.full(len(vertices), np.inf)
    for joint, parent in enumerate(skeleton.parents.tolist()):
        start, along = skeleton.rest[parent], skeleton.rest[joint] - skeleton.rest[parent]
        if parent < 0 or not along.any():
            continue
        foot = start + np.clip((vertices - start) @ along / (along @ along), 0.0, 1.0)[:, None] * along
        distance = np.linalg.norm(vertices - foot, axis=1)
        nearer = distance < apart
        away[nearer], apart[nearer] = (vertices - foot)[nearer], distance[nearer]
    laplacian = uniform_laplacian(rig.surface.faces, len(vertices))
    degree = np.maximum(laplacian.diagonal(), 1e-9)[:, None]
    for _ in range(_SMOOTHING):
        away = away - 0.5 * (laplacian @ away) / degree
    return _altered(rig, vertices + (factor - 1.0) * away)


def _noisy(bench: BenchRig, share: float) -> Rig:
    """Vertices displaced by a share of the edges' length there."""
    surface = bench.rig.surface
    edges = np.linalg.norm(surface.vertices[surface.faces] - surface.vertices[np.roll(surface.faces, 1, 1)], axis=2)
    length, count = np.zeros(len(surface.vertices)), np.zeros(len(surface.vertices))
    np.add.at(length, surface.faces, edges)
    np.add.at(count, surface.faces, 1.0)
    noise = np.random.default_rng(1).normal(size=surface.vertices.shape)
    return _altered(bench.rig, surface.vertices + share * (length / np.maximum(count, 1.0))[:, None] * noise)


def _off_centre(bench: BenchRig, share: float) -> Rig:
    """Joints displaced in random directions by a share of their distance from the skin."""
    skeleton, rng = bench.rig.skeleton, np.random.default_rng(2)
    distance = cKDTree(bench.rig.surface.vertices).query(skeleton.rest)[0]
    direction = rng.normal(size=skeleton.rest.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    inner = (skeleton.parents >= 0) & np.array([bool(children) for children in skeleton.children])
    return _altered(bench.rig, rest=skeleton.rest + (share * distance * inner)[:, None] * direction)


def _subdivided(bench: BenchRig) -> Rig:
    vertices, faces = trimesh.remesh.subdivide_loop(bench.rig.surface.vertices, bench.rig.surface.faces, iterations=1)
    return _altered(bench.rig, np.asarray(vertices), np.asarray(faces, dtype=np.int32))


def _coarser(bench: BenchRig, share: float) -> Rig:
    """A mesh with this share of the triangles (quadric error)."""
    surface = bench.rig.surface
    mesh = pv.PolyData.from_regular_faces(surface.vertices, surface.faces).decimate(1.0 - share)
    return _altered(bench.rig, np.asarray(mesh.points, dtype=np.float64), mesh.regular_faces.astype(np.int32))


def _longer(bench: BenchRig, factor: float) -> Rig:
    """Stretched along the longest side of its bounding box."""
    vertices = bench.rig.surface.vertices
    scale = np.ones(3)
    scale[int(np.ptp(vertices, axis=0).argmax())] = factor
    return _altered(bench.rig, vertices * scale, rest=bench.rig.skeleton.rest * scale)


def _half_closed(bench: BenchRig) -> Rig:
    """Digitised with its fingers curled by a third: poses bend it further from there."""
    posed = pose("curl_03", bench.rig.skeleton)
    assert posed is not None
    poses, skeleton = posed.poses, bench.rig.skeleton
    vertices = np.asarray(bench.covering.deform(poses)[0], dtype=np.float64)
    return _altered(bench.rig, vertices, rest=poses.positions[0].copy(), axes=rotate(poses.rotations[0], skeleton.axes))


ALTERATIONS: dict[str, Callable[[BenchRig], Rig]] = {
    "as it is": lambda bench: bench.rig,
    "flesh 1.3 times as thick": lambda bench: _thicker(bench, 1.3),
    "flesh 0.75 times as thick": lambda bench: _thicker(bench, 0.75),
    "noise, 5 % of the edges": lambda bench: _noisy(bench, 0.05),
    "joints off centre by 20 %": lambda bench: _off_centre(bench, 0.2),
    "joints off centre by 40 %": lambda bench: _off_centre(bench, 0.4),
    "subdivided once": _subdivided,
    "half of the triangles": lambda bench: _coarser(bench, 0.5),
    "a quarter of the triangles": lambda bench: _coarser(bench, 0.25),
    "1.4 times as long": lambda bench: _longer(bench, 1.4),
    "0.7 times as long": lambda bench: _longer(bench, 0.7),
    "digitised at a curl of 0.3": _half_closed,
}
"""Name → rig made from one of the benchmark."""
