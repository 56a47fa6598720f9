"""Creation of output folders."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError

__all__ = ["make_folder"]


def make_folder(path: Path) -> None:
    """Create a folder and its parents if they are missing.

    Raises:
        InputError: The folder cannot be created, for example because a file has its name.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        file = next(place for place in (path, *path.parents) if place.exists())
        raise InputError("is a file; want a folder to write into", path=file) from None
    except OSError as error:
        raise InputError(f"cannot write into this folder: {error.strerror}", path=path) from None
