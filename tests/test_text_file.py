"""Text and JSON files that people write, and what is said of those that are none."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.text_file import read_json, read_text


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b'\xef\xbb\xbf{"a": "\xc2\xb5"}')
    assert read_text(tmp_path / "a.json") == '{"a": "µ"}'
    assert read_json(tmp_path / "a.json") == {"a": "µ"}


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"{} \xe9", r"a\.json: is not UTF-8 text \(byte 3\)"),
        (b'{"a":\n 1,}', r"a\.json:2:4: is not JSON"),
        (b"[" * 100_000, r"a\.json: is nested too deeply"),
    ],
)
def test_what_is_no_json(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_json(tmp_path / "a.json")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.txt: cannot be read: No such file"):
        read_text(tmp_path / "none.txt")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        read_text(tmp_path)
