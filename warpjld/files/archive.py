"""Size checks of zip archives before unpacking."""

from __future__ import annotations

import zipfile
from pathlib import Path

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["check_archive"]


def check_archive(path: str | Path, kind: str = "zip archive") -> None:
    """Check that an archive does not exceed the limits ``members`` and ``unpacked-bytes``.

    Sizes are those stated in the archive's directory; Python's ``zipfile`` unpacks no more than these.

    Args:
        path: The archive.
        kind: Expected kind of file, for messages.

    Raises:
        InputError: It exceeds them, or is not an archive.
    """
    try:
        with zipfile.ZipFile(path) as file:
            members = file.infolist()
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile, EOFError) as error:
        raise InputError(f"is no {kind}, or a damaged one: {error}", path=path) from None
    check_limit("members", len(members), path=path)
    check_limit("unpacked-bytes", sum(member.file_size for member in members), of="unpacked", path=path)
