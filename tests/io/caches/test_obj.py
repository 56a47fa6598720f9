from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache, open_cache


def test_one_numbered_file_a_frame(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    files = export("walk.obj").files
    assert [path.name for path in files] == [f"walk.{number:04d}.obj" for number in range(3, 10)]
    for path, vertices in zip(files, clip, strict=True):
        mesh = trimesh.load(path, process=False, maintain_order=True)
        np.testing.assert_array_equal(mesh.vertices.astype(np.float32), vertices[surface.weld])
        np.testing.assert_array_equal(mesh.faces, surface.source_faces)
        np.testing.assert_allclose(mesh.visual.uv, surface.uv, atol=1e-7)


def test_a_former_longer_sequence_is_replaced(export: Callable[[str], Cache], surface: Surface, tmp_path: Path) -> None:
    files = export("walk.obj").files
    other = tmp_path / "walker.0003.obj"
    other.write_text("another sequence")
    clip = np.zeros((2, len(surface.vertices), 3), np.float32)
    with open_cache(tmp_path / "walk.obj", surface, frames=2, rate=24, start_frame=5) as cache:
        assert all(path.exists() for path in files)
        cache.write(clip)
    assert sorted(path.name for path in tmp_path.glob("walk*.obj")) == ["walk.0005.obj", "walk.0006.obj", other.name]
