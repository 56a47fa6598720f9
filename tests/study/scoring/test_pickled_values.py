"""Pickles are read and never executed: plain values come out as NumPy would read them, anything else is refused."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.study.scoring.pickled_values import read_object_array, values_of_pickle


class _Touches:
    """Unpickled, it makes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.path),)


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(a, b) and a.dtype == b.dtype  # type: ignore[arg-type, union-attr]
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    return a == b


_VALUES = {
    "grasp_qpos": np.linspace(0.0, 1.0, 12, dtype=np.float32).reshape(2, 6),
    "turned": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "big endian": np.arange(3, dtype=">i4"),
    "texts": np.array(["thumb", "index"]),
    "none": np.zeros((0, 3)),
    "scalar": np.float64(0.25),
    "flag": np.bool_(True),
    "path": "core/bottle",
    "nested": {"list": [1, -2.5, None, True, 10**20], "again": [1, -2.5]},
}


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_plain_values_come_out_as_they_went_in(protocol: int) -> None:
    shared = [1, 2]
    values = _VALUES | {"one": shared, "two": shared}
    assert _same(values_of_pickle(pickle.dumps(values, protocol=protocol)), values)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
        max_leaves=20,
    )
)
def test_any_plain_value_does(value: object) -> None:
    assert values_of_pickle(pickle.dumps(value)) == value


def test_numpy_files_of_dictionaries(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array(_VALUES, dtype=object))
    assert _same(read_object_array(tmp_path / "a.npy"), _VALUES)
    np.save(tmp_path / "b.npy", np.array([{"a": 1}, {"a": 2}], dtype=object))
    assert read_object_array(tmp_path / "b.npy") == [{"a": 1}, {"a": 2}]
    np.save(tmp_path / "c.npy", np.arange(3))
    assert np.array_equal(read_object_array(tmp_path / "c.npy"), np.arange(3))


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_nothing_is_run(tmp_path: Path, protocol: int) -> None:
    bad = _Touches(tmp_path / "made")
    for value in (bad, {"grasp_qpos": [1.0], "more": bad}, [np.zeros(2), bad]):
        with pytest.raises(InputError, match="mkdir' to be run: not done"):
            values_of_pickle(pickle.dumps(value, protocol=protocol))
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("name", ["builtins.eval", "os.system", "numpy.load", "numpy.core.multiarray.fromstring"])
def test_no_other_name_is_known(name: str) -> None:
    module, _, function = name.rpartition(".")
    with pytest.raises(InputError, match="asks for"):
        values_of_pickle(f"c{module}\n{function}\n(S'1'\ntR.".encode())


def test_damaged_files_are_told(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array(_VALUES, dtype=object))
    whole = (tmp_path / "a.npy").read_bytes()
    rng = np.random.default_rng(0)
    told = 0
    for k in range(100):
        damaged = bytearray(whole[: rng.integers(60, len(whole))] if k % 2 else whole)
        damaged[rng.integers(0, len(damaged))] ^= 1 << int(rng.integers(8))
        (tmp_path / "b.npy").write_bytes(damaged)
        try:
            read_object_array(tmp_path / "b.npy")
        except InputError as error:  # anything else fails the test
            told += "b.npy" in str(error)
    assert told > 50
