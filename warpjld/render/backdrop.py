"""Background pictures of rendered views (R135)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["before_picture", "check_backdrop"]


def before_picture(drawn: NDArray[np.uint8], empty: NDArray[np.bool_], path: Path) -> NDArray[np.uint8]:
    """Composite a rendered view over a background picture.

    Args:
        drawn: Rendered view, uint8 (height, width, 3 or more).
        empty: Mask of the pixels that show the background, shape (height, width).
        path: Picture file; it is scaled and cropped to the size of the view.

    Returns:
        The composite, uint8 (height, width, 3).

    Raises:
        InputError: The picture cannot be read.
    """
    height, width = drawn.shape[:2]
    return np.where(empty[..., None], _fitted(path, _modified(path), width, height), drawn[..., :3])


def check_backdrop(path: Path) -> None:
    """Check that a file is a readable picture.

    Raises:
        InputError: It is missing or not a picture; names the file.
    """
    _fitted(path, _modified(path), 16, 16)


def _modified(path: Path) -> int:
    """Time at which a file was last modified [ns], 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.exists() else 0


@lru_cache(maxsize=4)
def _fitted(path: Path, written: int, width: int, height: int) -> NDArray[np.uint8]:
    """Picture scaled and centre-cropped to a size; ``written`` makes the cache notice when the file changes."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as picture:
            return np.asarray(ImageOps.fit(picture.convert("RGB"), (width, height)), np.uint8)
    except FileNotFoundError as error:
        raise InputError("no such file", path=path) from error
    except (OSError, UnidentifiedImageError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"no picture that can be read: {error}", path=path) from error
