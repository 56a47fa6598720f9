"""Animated surfaces from archives: what is none is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.keyframes import load_keyframes
from warpjld.grasp.shapes import ball


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    thing = ball(0.1, subdivisions=1)
    path = tmp_path / "bag.npz"
    frames = np.array([0, 10])
    np.savez(path, vertices=np.stack([thing.vertices, 2.0 * thing.vertices]), faces=thing.faces, frames=frames)
    return path


def test_frames_in_between(archive: Path) -> None:
    shapes = load_keyframes(archive)
    np.testing.assert_allclose(shapes.at(5.0), 1.5 * shapes.at(0.0), atol=1e-9)


@pytest.mark.parametrize("damage", [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: b"\x89PNG" * 9])
def test_damaged_archives(archive: Path, damage) -> None:
    archive.write_bytes(damage(archive.read_bytes()))
    with pytest.raises(InputError, match=r"bag\.npz: is no archive of NumPy arrays"):
        load_keyframes(archive)


def test_archives_of_something_else(archive: Path) -> None:
    np.savez(archive, vertices=np.zeros((2, 3)))
    with pytest.raises(InputError, match="no animated surface: 'faces' is missing"):
        load_keyframes(archive)
