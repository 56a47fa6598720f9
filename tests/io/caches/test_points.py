"""PC2 and MDD against their published layouts, read with `struct`; their rest mesh with trimesh."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache


def test_pc2_layout(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    content = export("a.pc2").files[0].read_bytes()
    head = struct.Struct("<12siiffi")
    assert head.unpack_from(content) == (b"POINTCACHE2\0", 1, 50, 3.0, 1.0, 7)
    points = np.frombuffer(content, "<f4", offset=head.size).reshape(7, 50, 3)
    np.testing.assert_array_equal(points, clip[:, surface.weld])


def test_mdd_layout(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    content = export("a.mdd").files[0].read_bytes()
    assert struct.unpack_from(">ii", content) == (7, 50)
    np.testing.assert_allclose(np.frombuffer(content, ">f4", 7, offset=8), np.arange(3, 10) / 24, rtol=1e-7)
    points = np.frombuffer(content, ">f4", offset=8 + 28).reshape(7, 50, 3)
    np.testing.assert_array_equal(points, clip[:, surface.weld])


@pytest.mark.parametrize("suffix", [".pc2", ".mdd"])
def test_rest_mesh_lies_beside(export: Callable[[str], Cache], surface: Surface, suffix: str) -> None:
    cache = export(f"a{suffix}")
    assert [path.name for path in cache.files] == [f"a{suffix}", "a.rest.obj"]
    assert ".rest.obj" in cache.note
    mesh = trimesh.load(cache.files[1], process=False, maintain_order=True)
    np.testing.assert_array_equal(mesh.vertices.astype(np.float32), cache.rest)
    np.testing.assert_array_equal(mesh.faces, surface.source_faces)
