"""Picture files, written atomically: to a temporary file that is renamed when complete."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.whole_file import whole_file

__all__ = ["save_picture"]

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP", ".tif": "TIFF", ".tiff": "TIFF"}


def save_picture(path: str | Path, picture: NDArray[np.uint8]) -> Path:
    """Write a picture (height, width, 3) in the format of its suffix. Its folder is made if missing.

    Raises:
        InputError: Unknown suffix, or a file that cannot be written.
    """
    from PIL import Image

    path = Path(path)
    kind = _FORMATS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"unknown kind of picture '{path.suffix}': want one of {', '.join(_FORMATS)}", path=path)
    options = {"quality": 95} if kind in ("JPEG", "WEBP") else {}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            Image.fromarray(picture).save(part, format=kind, **options)
    except OSError as error:
        raise InputError(f"cannot write: {error.strerror or error}", path=path) from error
    return path
