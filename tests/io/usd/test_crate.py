"""Damaged crates are refused before OpenUSD allocates what they state."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.io.identity import files_of
from warpjld.io.usd.crate import check_crate
from warpjld.io.usd.stage import check_usd_content

Usd = pytest.importorskip("pxr.Usd")


@pytest.fixture(scope="module")
def crate(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A whole one."""
    path = tmp_path_factory.mktemp("crate") / "a.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    stage.DefinePrim("/World/Hand", "Mesh")
    stage.GetRootLayer().Save()
    return path.read_bytes()


def sections(crate: bytes) -> dict[str, tuple[int, int, int]]:
    """Place of its row, offset and size of each section."""
    (table,) = struct.unpack_from("<q", crate, 16)
    (count,) = struct.unpack_from("<Q", crate, table)
    rows = [table + 8 + 32 * k for k in range(count)]
    found = [(row, *struct.unpack_from("<16sqq", crate, row)) for row in rows]
    return {name.rstrip(b"\0").decode(): (row, start, size) for row, name, start, size in found}


def test_a_whole_one_is_let_through(crate: bytes) -> None:
    assert {"TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"} <= set(sections(crate))
    check_crate(crate, Path("a.usdc"))


@pytest.mark.parametrize("name", ["TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"])
def test_counts_that_cannot_be_are_refused(crate: bytes, name: str) -> None:
    _, start, _ = sections(crate)[name]
    damaged = bytearray(crate)
    struct.pack_into("<Q", damaged, start, 2**40)
    with pytest.raises(InputError, match=rf"a.usdc: damaged USD file: section {name} states {2**40} entries"):
        check_crate(bytes(damaged), Path("a.usdc"))


def test_places_outside_are_refused(crate: bytes) -> None:
    row, start, _ = sections(crate)["PATHS"]
    (table,) = struct.unpack_from("<q", crate, 16)
    changes = {
        "its table of contents is at byte": (16, 10**9),
        "more than fit in the file": (table, 116983803),
        "section PATHS lies outside": (row + 24, len(crate)),
        "states .* bytes of text": (sections(crate)["TOKENS"][1] + 8, 2**50),
    }
    for message, (place, value) in changes.items():
        damaged = bytearray(crate)
        struct.pack_into("<Q", damaged, place, value)
        with pytest.raises(InputError, match=message):
            check_crate(bytes(damaged), Path("a.usdc"))
    with pytest.raises(InputError, match="ends within its header"):
        check_crate(crate[:20], Path("a.usdc"))
    assert start > 0


def test_a_damaged_file_is_opened_by_nothing(crate: bytes, tmp_path: Path) -> None:
    (table,) = struct.unpack_from("<q", crate, 16)
    damaged = bytearray(crate)
    struct.pack_into("<Q", damaged, table, 116983803)
    path = tmp_path / "b.usdc"
    path.write_bytes(damaged)
    with pytest.raises(InputError, match=r"b\.usdc: damaged USD file: its table of contents has 116983803 sections"):
        check_usd_content(path)
    assert list(files_of(path)) == []
