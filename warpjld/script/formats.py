"""File suffixes and views that scripts may use, and a check that the packages they need are installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import PurePosixPath

from warpjld.errors import MissingExtraError
from warpjld.io.caches import FORMATS
from warpjld.motion.out import MOTION_OUT
from warpjld.render.camera import VIEWS as _VIEWS

__all__ = [
    "EXPORTS",
    "FILMS",
    "MOTIONS",
    "PAGE",
    "PICTURES",
    "TABLES",
    "VIEW_WORDS",
    "VOLUMES",
    "check_available",
    "video_is_available",
]

PICTURES = (".png",)
TABLES = (".csv", ".parquet")
VOLUMES = (".pvd",)
FILMS = (".mp4", ".mov", ".mkv", ".gif", ".webp", ".html")
_VIDEO = FILMS[:3]
PAGE = ".html"
EXPORTS = tuple(FORMATS)
MOTIONS = tuple(MOTION_OUT)
VIEW_WORDS = tuple(name.upper() for name in _VIEWS)


def video_is_available() -> bool:
    """Whether H.264 films can be made here."""
    return find_spec("imageio_ffmpeg") is not None


def check_available(names: Iterable[str]) -> None:
    """Raise MissingExtraError where a file's format needs an optional dependency that is not installed."""
    for name in names:
        suffix = PurePosixPath(name).suffix.lower()
        if suffix in _VIDEO and not video_is_available():
            raise MissingExtraError(f"the film '{name}'", "film")
        if suffix == PAGE and find_spec("viser") is None:
            raise MissingExtraError(f"the page '{name}'", "studio")
        if suffix == ".parquet" and find_spec("pyarrow") is None:
            raise MissingExtraError(f"the table '{name}'", "study")
        if suffix in (".usd", ".usdc") and find_spec("pxr") is None:
            raise MissingExtraError(f"'{name}' in USD", "usd")
        if suffix == ".abc" and find_spec("alembic3d") is None:
            raise MissingExtraError(f"'{name}' in Alembic", "abc")
