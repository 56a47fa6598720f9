"""How many frames are deformed at once."""

from __future__ import annotations

__all__ = ["FEW_FRAMES", "frames_at_once"]

FEW_FRAMES = 16
"""Frames of a block of a large surface, or of one whose skin is then separated, which takes more memory a frame."""
_MOST_FRAMES = 1024
_VERTICES = 1 << 17
"""Vertices of a block of a small surface: 1.5 MB, beside which the overhead of a call, milliseconds, is negligible."""


def frames_at_once(vertices: int) -> int:
    """Frames of a block, so that its memory does not grow with the length of a motion: 16, more of small surfaces."""
    return min(max(_VERTICES // max(vertices, 1), FEW_FRAMES), _MOST_FRAMES)
