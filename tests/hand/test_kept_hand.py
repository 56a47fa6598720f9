"""A kept hand is the one that was built, and no other."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.files.kept_files import CACHE_VARIABLE
from warpjld.hand import build_hand
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    return tmp_path


def _alike(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other)
    if hasattr(one, "__dataclass_fields__"):
        assert type(one) is type(other)
        return all(_alike(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))  # type: ignore[arg-type]
    if isinstance(one, tuple):
        return isinstance(other, tuple) and len(one) == len(other) and all(map(_alike, one, other))
    return one == other


def test_it_is_the_one_that_was_built(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    side = "right"
    built = build_hand(side, resolution=1500, length=0.18)
    monkeypatch.setattr("warpjld.hand.kept.build_hand", lambda *_, **__: built)
    assert _alike(kept_hand(side, resolution=1500, length=0.18), built)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("built again")

    monkeypatch.setattr("warpjld.hand.kept.build_hand", refuse)
    assert _alike(kept_hand(side, length=0.18, resolution=1500), built)
    for other in ({"resolution": 1501, "length": 0.18}, {"resolution": 1500}):
        with pytest.raises(AssertionError, match="again"):
            kept_hand(side, **other)


def test_a_broken_file_is_made_anew_and_bad_measures_are_refused(
    folder: Path, hands: dict[str, Rig], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="length"):
        kept_hand(length=3.0)
    assert not list(folder.iterdir())
    made = []

    def again(side: str, **options: object) -> Rig:
        assert options == {"resolution": 1500}
        made.append(side)
        return hands[side]

    monkeypatch.setattr("warpjld.hand.kept.build_hand", again)
    whole = kept_hand(resolution=1500)
    (file,) = folder.iterdir()
    for broken in (b"", b"no hand", file.read_bytes()[:2000]):
        file.write_bytes(broken)
        assert _alike(kept_hand(resolution=1500), whole)
    assert made == ["left"] * 4
    assert list(folder.iterdir()) == [file]
