"""Bounds of the binary USD format (crate, ``.usdc``), checked before OpenUSD reads it.

OpenUSD's crate reader allocates as many entries as a file states before it finds that the file is shorter: a damaged
count in a file of a few kilobytes takes gigabytes. Layout: 8 bytes of magic, 8 of version, the offset of the table of
contents (int64); there a count (uint64) and sections of a name (16 bytes), offset and size (int64 each). A section
begins with its number of entries (uint64); that of tokens goes on with the sizes of its text, unpacked and packed.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NoReturn

from warpjld.errors import InputError

__all__ = ["MAGIC", "check_crate"]

MAGIC = b"PXR-USDC"
_HEADER, _SECTION = 24, 32  # bytes
_COUNTED = (b"TOKENS", b"STRINGS", b"FIELDS", b"FIELDSETS", b"PATHS", b"SPECS")
_RATIO = 255
"""Largest ratio of unpacked to packed bytes of LZ4."""
_PACKED = 4 * _RATIO
"""Most integers per byte of a section: each takes two bits at least before LZ4 packs them."""


def check_crate(raw: bytes, path: Path) -> None:
    """Refuse a crate whose sections lie outside of it, or state more entries than they can hold.

    Raises:
        InputError: Names the file and what is wrong.
    """
    if len(raw) < _HEADER:
        _damaged(path, "it ends within its header")
    (table,) = struct.unpack_from("<q", raw, 16)
    if not _HEADER <= table <= len(raw) - 8:
        _damaged(path, f"its table of contents is at byte {table} of {len(raw)}")
    (count,) = struct.unpack_from("<Q", raw, table)
    if count > (len(raw) - table - 8) // _SECTION:
        _damaged(path, f"its table of contents has {count} sections, more than fit in the file")
    for k in range(count):
        name, start, size = struct.unpack_from("<16sqq", raw, table + 8 + _SECTION * k)
        _check_section(raw, name.rstrip(b"\0"), start, size, path)


def _check_section(raw: bytes, name: bytes, start: int, size: int, path: Path) -> None:
    title = f"section {name.decode('ascii', 'backslashreplace')}"
    if start < 0 or size < 0 or start + size > len(raw):
        _damaged(path, f"{title} lies outside of the file")
    if name not in _COUNTED:
        return
    if size < 8:
        _damaged(path, f"{title} has no number of entries")
    (entries,) = struct.unpack_from("<Q", raw, start)
    if entries > _PACKED * size:
        _damaged(path, f"{title} states {entries} entries in {size} bytes")
    if name == b"TOKENS" and size >= 16:
        (text,) = struct.unpack_from("<Q", raw, start + 8)
        if text > _RATIO * size:
            _damaged(path, f"{title} states {text} bytes of text in {size} bytes")


def _damaged(path: Path, what: str) -> NoReturn:
    raise InputError(f"damaged USD file: {what}", path=path)
