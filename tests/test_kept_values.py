"""Values kept in files: what comes back is what was made, and nothing else."""

from __future__ import annotations

import ast
import importlib.util
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.files.kept_files import CACHE_VARIABLE
from warpjld.files.kept_values import hash_of, kept_sources, kept_value


@dataclass(frozen=True, eq=False)
class _Inner:
    numbers: NDArray[np.int32]
    name: str


@dataclass(frozen=True, eq=False)
class _Outer:
    parts: tuple[_Inner, ...]
    sets: dict[str, NDArray[np.float64]]
    size: float
    none: None = None


def _made() -> _Outer:
    inner = _Inner(np.arange(6, dtype=np.int32).reshape(2, 3), "a ½")
    return _Outer((inner, inner), {"x.y": np.array([np.pi, np.nan]), "": np.zeros((0, 3))}, 0.1 + 0.2)


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    return tmp_path


def _never() -> _Outer:
    raise AssertionError("it was kept")


def test_what_comes_back_is_what_was_made(folder: Path) -> None:
    first, notes = kept_value("thing", "key", (_Inner, _Outer), _made)
    second, again = kept_value("thing", "key", (_Inner, _Outer), _never)
    assert notes == again == ()
    assert second.size == first.size
    assert second.none is None
    assert [one.name for one in second.parts] == ["a ½", "a ½"]
    assert second.parts[0].numbers.dtype == np.int32
    np.testing.assert_array_equal(second.parts[1].numbers, first.parts[1].numbers)
    assert list(second.sets) == ["x.y", ""]
    assert second.sets[""].shape == (0, 3)
    assert second.sets["x.y"].tobytes() == first.sets["x.y"].tobytes()


@pytest.mark.parametrize("damage", ["short", "text", "bits"])
def test_a_damaged_file_is_named_and_made_anew(folder: Path, damage: str) -> None:
    kept_value("thing", "key", (_Inner, _Outer), _made)
    (file,) = folder.glob("thing-*.npz")
    whole = file.read_bytes()
    bits = bytearray(whole)
    bits[len(bits) // 2] ^= 0xFF
    file.write_bytes({"short": whole[: len(whole) // 2], "text": b"no archive", "bits": bytes(bits)}[damage])
    made, notes = kept_value("thing", "key", (_Inner, _Outer), _made)
    assert made.size == 0.1 + 0.2
    (note,) = notes
    assert str(file) in note
    assert kept_value("thing", "key", (_Inner, _Outer), _never)[1] == ()


def test_every_number_counts() -> None:
    one = _made()
    seen = {hash_of(one), hash_of(one, 1), hash_of(one, 1.0), hash_of(one, "1"), hash_of(one, None)}
    for change in (np.float32, np.float64, np.int64):
        seen.add(hash_of(_Inner(one.parts[0].numbers.astype(change), "a")))
    seen.add(hash_of(_Inner(one.parts[0].numbers.T, "a")))
    seen.add(hash_of(_Inner(one.parts[0].numbers + 1, "a")))
    assert len(seen) == 10
    assert hash_of(_made()) == hash_of(_made())


def test_every_module_that_meshing_runs_through_counts() -> None:
    counted = {file.resolve() for file in kept_sources()}
    todo, reached = ["warpjld.simulation.bodies.kept_flesh"], set()
    while todo:
        module = todo.pop()
        try:
            spec = importlib.util.find_spec(module)
        except ModuleNotFoundError:  # a function or class: not a module
            continue
        if module in reached or spec is None or spec.origin is None:
            continue
        reached.add(module)
        file = Path(spec.origin)
        assert file.resolve() in counted or file.name == "__init__.py", module
        if file.name == "__init__.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("warpjld"):
                todo += [str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)]
    assert len(reached) > 40
