"""A small clip over a surface whose texture seam splits vertices, so that welded and source order differ."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.geometry.surface import Surface, weld_surface
from warpjld.io.caches import Cache, open_cache

FRAMES, RATE, START = 7, 24.0, 3


@pytest.fixture(scope="session")
def surface() -> Surface:
    """A closed prism of 9 sides and 5 rings; column 9 repeats column 0 with other texture coordinates."""
    columns, rings = 10, 5
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rings))
    angle = 2 * np.pi * u
    source = np.stack([0.03 * np.cos(angle), 0.1 * v, 0.02 * np.sin(angle)], axis=-1).reshape(-1, 3)
    a = (np.arange(rings - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + columns, a + 1], 1), np.stack([a + 1, a + columns, a + columns + 1], 1)])
    shuffled = np.random.default_rng(5).permutation(len(source))  # source order that no welding gives by chance
    uv = np.stack([u, v], axis=-1).reshape(-1, 2).astype(np.float32)
    rank = np.argsort(shuffled)
    result = weld_surface(source[shuffled], rank[faces], uv=uv[shuffled])
    assert len(result.vertices) == 45 < len(result.weld) == 50
    return result


@pytest.fixture(scope="session")
def clip(surface: Surface) -> np.ndarray:
    """Welded positions (FRAMES, V, 3): bending and swelling, every frame different."""
    time = np.linspace(0, 1, FRAMES)[:, None]
    x, y, z = surface.vertices.T
    moved = np.stack([x + 0.3 * time * y**2 / 0.1, y * (1 + 0.2 * time), z * (1 - 0.3 * time)], axis=-1)
    return moved.astype(np.float32)


@pytest.fixture
def export(surface: Surface, clip: np.ndarray, tmp_path: Path) -> Callable[[str], Cache]:
    """Write the clip in two blocks and give the closed cache."""

    def write(name: str) -> Cache:
        with open_cache(tmp_path / name, surface, frames=FRAMES, rate=RATE, start_frame=START, name="hand") as cache:
            cache.write(clip[:4])
            cache.write(clip[4:])
        return cache

    return write
