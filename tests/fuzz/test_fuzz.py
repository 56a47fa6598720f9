"""A few damaged inputs of every kind: read, or refused in one line. ``python -m tests.fuzz`` tries many."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given, settings

from tests.fuzz.damage import damaged
from tests.fuzz.grammar import scripts
from tests.fuzz.sound import KINDS, sound
from tests.fuzz.trial import tried


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_are_errors_of_one_line(name: str, tmp_path: Path) -> None:
    path = sound(name, tmp_path)
    data = path.read_bytes()
    KINDS[name][1](path)  # what is sound is read
    for n in range(6):
        path.write_bytes(damaged(data, random.Random(f"{name} {n}")))
        told = tried(name, path)
        assert not told, f"damage {n}: {told}"


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
