"""Archives written piece by piece are those that NumPy reads, and take no more memory than a piece."""

from __future__ import annotations

import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import WarpjldError
from warpjld.files.array_archive import ArrayArchive


def test_pieces_and_whole_arrays_are_read_by_numpy(tmp_path: Path) -> None:
    rows = np.random.default_rng(0).normal(size=(10, 4, 3)).astype(np.float32)
    whole = {
        "names": np.array(["a", "bc"]),
        "rate": np.array(24.0),
        "flag": np.array(True),
        "none": np.zeros((0, 3)),
        "turned": np.arange(6).reshape(2, 3).T,
    }
    with ArrayArchive(tmp_path / "a.npz") as archive:
        archive.begin("rows", rows.shape, "<f4")
        for start in range(0, 10, 4):
            archive.extend(rows[start : start + 4])
        for name, array in whole.items():
            archive.add(name, array)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as read:
        assert read.files == ["rows", *whole]
        for name, array in (whole | {"rows": rows}).items():
            np.testing.assert_array_equal(read[name], array)
            assert (read[name].dtype, read[name].shape) == (array.dtype, array.shape)
    np.savez(tmp_path / "b.npz", allow_pickle=False, rows=rows, **{k: v for k, v in whole.items() if k != "turned"})
    with zipfile.ZipFile(tmp_path / "a.npz") as one, zipfile.ZipFile(tmp_path / "b.npz") as other:
        for name in other.namelist():
            assert one.read(name) == other.read(name)


@pytest.mark.parametrize(("given", "why"), [(2, "'rows': 48 bytes too few"), (5, "'rows': 24 bytes too many")])
@pytest.mark.parametrize("then", [True, False], ids=["before another", "at the end"])
def test_an_array_of_other_length_than_announced_is_refused(tmp_path: Path, given: int, why: str, then: bool) -> None:
    archive = ArrayArchive(tmp_path / "a.npz")
    archive.begin("rows", (4, 3), np.float64)
    archive.extend(np.zeros((given, 3)))
    with pytest.raises(WarpjldError, match=why):
        archive.add("next", [1.0]) if then else archive.close()
    archive.discard()
    archive.discard()


def test_memory_does_not_grow_with_the_array(tmp_path: Path) -> None:
    def peak(pieces: int) -> int:
        piece = np.ones((1000, 30))
        tracemalloc.start()
        with ArrayArchive(tmp_path / "a.npz") as archive:
            archive.begin("rows", (1000 * pieces, 30), np.float64)
            for _ in range(pieces):
                archive.extend(piece)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(1)
    assert peak(40) < peak(2) + 100_000  # bytes; the array has 9.6 million
