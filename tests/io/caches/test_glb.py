"""The morphs and their animation read back with pygltflib, the rest mesh with trimesh."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache, open_cache
from warpjld.io.caches.glb import MAX_FRAMES

_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def _array(document: pygltflib.GLTF2, number: int) -> np.ndarray:
    accessor = document.accessors[number]
    view = document.bufferViews[accessor.bufferView]
    kind = np.dtype("<f4" if accessor.componentType == pygltflib.FLOAT else "<u4")
    width = _COMPONENTS[accessor.type]
    assert view.byteOffset % 4 == 0
    assert view.byteLength == accessor.count * width * 4
    array = np.frombuffer(document.binary_blob(), kind, accessor.count * width, view.byteOffset).reshape(-1, width)
    if accessor.min:
        np.testing.assert_array_equal(np.float32(accessor.min), array.min(axis=0))
        np.testing.assert_array_equal(np.float32(accessor.max), array.max(axis=0))
    return array


def test_animated_weights_give_the_frames(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    document = pygltflib.GLTF2().load(str(export("a.glb").files[0]))
    mesh = document.meshes[0]
    (primitive,) = mesh.primitives
    rest = _array(document, primitive.attributes.POSITION)
    np.testing.assert_array_equal(_array(document, primitive.indices).reshape(-1, 3), surface.source_faces)
    targets = np.stack([_array(document, target["POSITION"]) for target in primitive.targets])
    assert all(document.accessors[target["POSITION"]].min for target in primitive.targets)
    sampler = document.animations[0].samplers[0]
    times, weights = _array(document, sampler.input), _array(document, sampler.output).reshape(7, 7)
    assert document.accessors[sampler.input].min == [0.0]
    np.testing.assert_allclose(times[:, 0], np.arange(7) / 24, rtol=1e-6)
    frames = rest + np.einsum("ft,tvk->fvk", weights, targets)
    np.testing.assert_allclose(frames, clip[:, surface.weld], atol=2e-8)
    assert mesh.extras["targetNames"] == [f"frame {n}" for n in range(3, 10)]

    base = _array(document, primitive.attributes.NORMAL)
    for target in primitive.targets:
        normals = base + _array(document, target["NORMAL"])
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)


def test_rest_mesh_and_texture(export: Callable[[str], Cache], surface: Surface) -> None:
    scene = trimesh.load(export("a.glb").files[0], process=False, maintain_order=True)
    (mesh,) = scene.geometry.values()
    np.testing.assert_array_equal(mesh.vertices.astype(np.float32), surface.vertices.astype(np.float32)[surface.weld])
    np.testing.assert_array_equal(mesh.faces, surface.source_faces)
    np.testing.assert_allclose(mesh.visual.uv, surface.uv, atol=1e-6)


def test_long_clips_are_pointed_elsewhere(surface: Surface, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"301 frames of 50 vertices.*short clips.*\.usdc"):
        open_cache(tmp_path / "a.glb", surface, frames=MAX_FRAMES + 1, rate=24)
