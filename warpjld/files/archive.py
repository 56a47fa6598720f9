"""Zip archives looked at before anything of them is unpacked."""

from __future__ import annotations

import zipfile
from pathlib import Path

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["check_archive"]


def check_archive(path: str | Path, kind: str = "zip archive") -> None:
    """Make sure that an archive holds no more than the limits ``members`` and ``unpacked-bytes`` allow.

    Sizes are those that the archive's directory states; Python's ``zipfile`` unpacks no more than it does.

    Args:
        path: The archive.
        kind: What it should be, for messages.

    Raises:
        InputError: It does, or is no archive.
    """
    try:
        with zipfile.ZipFile(path) as file:
            members = file.infolist()
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile, EOFError) as error:
        raise InputError(f"is no {kind}, or a damaged one: {error}", path=path) from None
    check_limit("members", len(members), path=path)
    check_limit("unpacked-bytes", sum(member.file_size for member in members), of="unpacked", path=path)
