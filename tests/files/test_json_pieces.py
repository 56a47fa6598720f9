"""Large JSON files, decoded item by item: the same values and refusals as of files that are read whole."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.files.json_pieces import JsonList, JsonObject, json_pieces
from warpjld.files.text_file import read_json

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(st.text(max_size=5), inner, max_size=5),
    max_leaves=40,
)
PIECE = 64  # smaller than most of the files here, so that their containers are indexed


def plain(value: Any) -> Any:
    """A value whose indexed containers are read."""
    if isinstance(value, JsonList):
        return [plain(one) for one in value]
    return {name: plain(one) for name, one in value.items()} if isinstance(value, JsonObject) else value


def pieces(path: Path, **how: Any) -> Any:
    with json_pieces(path, piece=PIECE, **how) as content:
        return plain(content)


def refusal(path: Path, read: Any) -> str | None:
    try:
        read(path)
    except InputError as error:
        return str(error)
    return None


@settings(max_examples=12, derandomize=True, deadline=None)
@given(VALUES, st.booleans(), st.sampled_from((None, 1)))
def test_values_are_those_of_a_file_read_whole(tmp_path_factory: pytest.TempPathFactory, value: Any, plain_ascii: bool,
                                               indent: int | None) -> None:  # fmt: skip
    path = tmp_path_factory.mktemp("json") / "a.json"
    path.write_text(json.dumps([value, value], ensure_ascii=plain_ascii, indent=indent), encoding="utf-8")
    assert pieces(path) == read_json(path)
    lines = path.with_suffix(".jsonl")
    lines.write_text("\n".join(json.dumps(value, ensure_ascii=plain_ascii) for _ in range(3)), encoding="utf-8")
    assert pieces(lines, lines=True) == [read_json(path)[0]] * 3


def test_damaged_files_are_refused_at_the_same_place(tmp_path: Path) -> None:
    frame = {"points": [[0.125, -1e-3, 2], [1, 2, 3]], "side": 'le"ft', "seen": True, "n": None}
    text = json.dumps({"fps": 30, "frames": [frame] * 4}, indent=1)
    rng, path, refused = np.random.default_rng(18), tmp_path / "a.json", 0
    for trial in range(120):
        at, mark = int(rng.integers(len(text))), '{}[],:"x0.-\\ \n'[rng.integers(14)]
        path.write_text(text[:at] if trial % 4 == 0 else text[:at] + mark + text[at + trial % 2 :])
        whole, stepwise = refusal(path, read_json), refusal(path, pieces)
        assert (whole is None) == (stepwise is None), path.read_text()
        if whole is not None and stepwise is not None:  # Python's decoders word some faults of objects differently
            refused += 1
            assert stepwise.startswith(str(path))
            line, other = (int(said[len(str(path)) + 1 :].split(":")[0]) for said in (whole, stepwise))
            assert abs(line - other) <= 1, (whole, stepwise)
        else:
            assert pieces(path) == read_json(path)
    assert refused > 60


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        (b"", "Expecting value"),
        (b"[" * 300, "the limit is 200"),
        (b"[" + b"[" * 250 + b"]" * 250 + b"]", "the limit is 200"),
        (b"[1] x", "Extra data"),
        (b'["' + b"a" * 50 + b'\xff"]', "is not UTF-8"),
        (b"[" + b"1" * 300 + b"]", "a number of 64 digits or more"),
        (b'["' + b"a" * 3000, "a text of 64 bytes or more"),
        (b'["aaa', "Unterminated string"),
        ("[1, 2]".encode("utf-16"), "the limit is 9 "),
    ],
)
def test_refusals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: bytes, wrong: str) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_JSON_BYTES", "9")
    (tmp_path / "a.json").write_bytes(text)
    with pytest.raises(InputError, match=wrong):
        pieces(tmp_path / "a.json")


def test_items_are_counted_and_lists_of_numbers_are_arrays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [[k, 0.5 * k] for k in range(3000)]
    (tmp_path / "a.json").write_text(json.dumps({"rows": rows, "odd": [*rows, [1]]}))
    with json_pieces(tmp_path / "a.json", piece=PIECE) as content:
        assert np.array_equal(np.asarray(content["rows"]), rows)
        assert content["rows"][-1] == rows[-1]
        assert content["rows"][:2] == rows[:2]
        with pytest.raises(ValueError, match="shape"):
            np.asarray(content["odd"])
    monkeypatch.setenv("WARPJLD_LIMIT_FRAMES", "4000")
    with pytest.raises(InputError, match=r"items of its large lists: 4,096 frames; the limit is 4,000 "):
        pieces(tmp_path / "a.json")
