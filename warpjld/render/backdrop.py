"""Pictures behind everything that is drawn (R135)."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["before_picture", "check_backdrop"]


def before_picture(drawn: NDArray[np.uint8], empty: NDArray[np.bool_], path: Path) -> NDArray[np.uint8]:
    """What is drawn, uint8 (height, width, 3), before a picture that fills the view where ``empty``."""
    height, width = drawn.shape[:2]
    return np.where(empty[..., None], _filling(path, _written(path), width, height), drawn[..., :3])


def check_backdrop(path: Path) -> None:
    """Refuse what is no picture.

    Raises:
        InputError: Names the file.
    """
    _filling(path, _written(path), 16, 16)


def _written(path: Path) -> int:
    """When a file was written last [ns], 0 where it is not there."""
    return path.stat().st_mtime_ns if path.exists() else 0


@lru_cache(maxsize=4)
def _filling(path: Path, written: int, width: int, height: int) -> NDArray[np.uint8]:
    """A picture, as it was written at some time, cut to a size's proportions around its middle, in that size."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as picture:
            return np.asarray(ImageOps.fit(picture.convert("RGB"), (width, height)), np.uint8)
    except FileNotFoundError as error:
        raise InputError("no such file", path=path) from error
    except (OSError, UnidentifiedImageError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"no picture that can be read: {error}", path=path) from error
