"""A few damaged inputs of every kind: read, or refused in one line. ``python -m tests.fuzz`` tries many."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from tests.fuzz.damage import damaged
from tests.fuzz.grammar import scripts
from tests.fuzz.sound import KINDS, sound
from tests.fuzz.trial import tried
from warpjld.errors import InputError


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_are_errors_of_one_line(name: str, tmp_path: Path) -> None:
    path = sound(name, tmp_path)
    data = path.read_bytes()
    KINDS[name][1](path)  # what is sound is read
    for n in range(4):  # ``python -m tests.fuzz`` goes on from there
        path.write_bytes(damaged(data, random.Random(f"{name} {n}")))
        told = tried(name, path)
        assert not told, f"damage {n}: {told}"


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("pose.json", rb": 84", b": 1" + b"0" * 400),
        ("record.json", rb'"motion": "[^"]*"', b'"motion": 5'),
        ("record.json", rb'"notes": \[\]', b'"notes": ' + b"[" * 100_000),
        ("record.json", rb'"motion": "', b'"motion": "\\u0000'),
        ("a.gltf", rb'"name": ?"one"', b'"name": 1.5'),
    ],
)
def test_what_it_has_found(name: str, old: bytes, new: bytes, tmp_path: Path) -> None:
    path = sound(name, tmp_path)
    damaged_one, count = re.subn(old, lambda match: new, path.read_bytes(), count=1)
    assert count == 1
    path.write_bytes(damaged_one)
    assert not tried(name, path)


def test_a_binding_whose_indices_lie_outside_is_refused(tmp_path: Path) -> None:
    """Kernels index memory with them, unchecked."""
    path = sound("binding.npz", tmp_path)
    with np.load(path) as file:
        arrays = dict(file)
    for name in ("runs.slots", "runs.order", "runs.tiles", "runs.runs", "anchors.segment", "fields.turns.indices"):
        for value in (-5, 1_000_000):
            wrong = arrays[name].copy()
            wrong[-1] = value
            np.savez(path, **(arrays | {name: wrong}))
            with pytest.raises(InputError, match=r"not a binding as 'warpjld bind' writes them"):
                KINDS["binding.npz"][1](path)


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A script in a folder that has the files which scripts name."""
    return sound("a.jld", tmp_path_factory.mktemp("stage"))


@given(scripts())
@settings(max_examples=40, derandomize=True, deadline=None)
def test_scripts_by_the_grammar(stage: Path, text: str) -> None:
    stage.write_text(text, "utf-8", errors="surrogatepass")
    assert not tried("a.jld", stage)


def test_what_is_looked_for_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(path: Path) -> object:
        return 1 / 0

    monkeypatch.setitem(KINDS, "a.csv", (KINDS["a.csv"][0], broken))
    assert "ZeroDivisionError" in tried("a.csv", sound("a.csv", tmp_path))
