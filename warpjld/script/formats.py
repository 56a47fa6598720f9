"""Names of files and views that scripts may ask for, checked before anything is computed."""

from __future__ import annotations

from warpjld.io.caches import FORMATS

__all__ = ["EXPORTS", "FILMS", "PICTURES", "VIEWS"]

PICTURES = (".png",)
FILMS = (".mp4", ".webm", ".gif")
EXPORTS = tuple(FORMATS)
VIEWS = ("PALMAR", "DORSAL", "SIDE", "FRONT", "BACK", "TOP", "BOTTOM", "THREE_QUARTER")
