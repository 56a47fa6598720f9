"""Alembic caches read back by the library's own reader."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warpjld.errors import InputError, MissingExtraError
from warpjld.files.whole_file import part_of
from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache, open_cache

pytest.importorskip("alembic3d")


def opened(path: Path) -> tuple[Any, Any]:
    """The archive, to be kept, and the schema of its only mesh."""
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(path))
    (transform,) = archive.getTop().children
    (mesh,) = transform.children
    assert (transform.getName(), mesh.getName()) == ("hand", "handShape")
    return archive, AbcGeom.IPolyMesh(mesh.getParent(), mesh.getName()).getSchema()


def points(schema: Any, frame: int) -> np.ndarray:
    return np.array([tuple(p) for p in schema.getValue(_at(frame)).getPositions()], dtype=np.float32)


def _at(frame: int) -> Any:
    from alembic3d.Abc import ISampleSelector

    return ISampleSelector((3 + frame) / 24)  # a time: Python does not choose the overload with an index


def test_samples_are_the_frames(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    archive, schema = opened(export("a.abc").files[0])
    assert archive.valid()
    assert schema.getNumSamples() == len(clip)
    times = [schema.getTimeSampling().getSampleTime(n) for n in range(len(clip))]
    np.testing.assert_allclose(times, np.arange(3, 10) / 24, rtol=1e-12)
    for frame, vertices in enumerate(clip):
        np.testing.assert_array_equal(points(schema, frame), vertices[surface.weld])
        bounds = schema.getValue(_at(frame)).getSelfBounds()
        np.testing.assert_allclose([tuple(bounds.min()), tuple(bounds.max())], [vertices.min(0), vertices.max(0)])


def test_faces_are_clockwise_and_hold_for_all_frames(export: Callable[[str], Cache], surface: Surface) -> None:
    archive, schema = opened(export("a.abc").files[0])
    assert archive.valid()
    assert schema.isConstant() is False
    assert str(schema.getTopologyVariance()) == "kHomogenousTopology"
    for frame in (0, 6):
        value = schema.getValue(_at(frame))
        assert set(value.getFaceCounts()) == {3}
        np.testing.assert_array_equal(np.reshape(value.getFaceIndices(), (-1, 3))[:, ::-1], surface.source_faces)


def test_texture_by_corner(export: Callable[[str], Cache], surface: Surface) -> None:
    archive, schema = opened(export("a.abc").files[0])
    assert archive.valid()
    uv = schema.getUVsParam().getExpandedValue().getVals()
    np.testing.assert_array_equal(
        np.reshape([tuple(pair) for pair in uv], (-1, 3, 2))[:, ::-1], surface.uv[surface.source_faces]
    )


def test_without_texture(surface: Surface, clip: np.ndarray, tmp_path: Path) -> None:
    with open_cache(tmp_path / "a.abc", replace(surface, uv=None), frames=7, rate=24, name="hand") as cache:
        cache.write(clip)
    archive, schema = opened(tmp_path / "a.abc")
    assert archive.valid()
    assert not schema.getUVsParam().valid()


def test_a_name_with_a_slash(surface: Surface, clip: np.ndarray, tmp_path: Path) -> None:
    from alembic3d.Abc import IArchive

    with open_cache(tmp_path / "a.abc", surface, frames=7, rate=24, name="left/hand") as cache:
        cache.write(clip)
    archive = IArchive(str(tmp_path / "a.abc"))
    assert [child.getName() for child in archive.getTop().children] == ["left_hand"]


def test_a_place_that_cannot_be_written(surface: Surface, tmp_path: Path) -> None:
    part_of(tmp_path / "a.abc").mkdir()
    with (
        pytest.raises(InputError, match="cannot write"),
        open_cache(tmp_path / "a.abc", surface, frames=1, rate=25),
    ):
        pass


def test_missing_extra_is_named(surface: Surface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "alembic3d", None)
    with (
        pytest.raises(MissingExtraError, match=r"warpjld\[abc\]"),
        open_cache(tmp_path / "a.abc", surface, frames=1, rate=25),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_ends_no_process(surface: Surface, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda place: type("Usage", (), {"free": 1 << 20}))
    frames = np.zeros((1, len(surface.vertices), 3), np.float32)
    with (
        pytest.raises(InputError, match="No space left on device"),
        open_cache(tmp_path / "a.abc", surface, frames=1, rate=25) as cache,
    ):
        cache.write(frames)
    assert not list(tmp_path.iterdir())
