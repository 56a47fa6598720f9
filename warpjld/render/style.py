"""Settings of pictures: colours, and rendering effort."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["Quality", "Style"]


@dataclass(frozen=True)
class Quality:
    """Rendering effort per picture.

    Attributes:
        supersampling: Factor by which the picture is drawn larger in both directions, then averaged.
        occlusion: Darken creases and contacts (ambient occlusion).
    """

    supersampling: int = 2
    occlusion: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.supersampling <= 8:
            raise InputError(f"supersampling: want 1…8, got {self.supersampling}")

    @classmethod
    def film(cls) -> Quality:
        """Several times faster, for many frames: antialiased, without occlusion."""
        return cls(occlusion=False)

    @classmethod
    def draft(cls) -> Quality:
        """Fastest: neither antialiasing nor occlusion."""
        return cls(supersampling=1, occlusion=False)


@dataclass(frozen=True)
class Style:
    """Colours as names or ``#rrggbb``.

    Attributes:
        skin: The surface's colour where it is not coloured by values.
        opacity: Opacity of the skin in shaded pictures.
        background: Colours at the bottom and the top of the background.
        line: Wire-frame edges that face the camera.
        hidden_line: Wire-frame edges that face away.
        veil: Opacity of the skin in wire-frame pictures.
        bone: Segments of the skeleton.
        joint: Its joints.
        ink: Captions.
        colormap: Name of a Matplotlib colour map for values.
        picture: File of a background picture, which fills the view; None for the background's colours.
    """

    skin: str = "#f0bda4"
    opacity: float = 1.0
    background: tuple[str, str] = ("#d5d6d8", "#f4f3f1")
    line: str = "#5b6572"
    hidden_line: str = "#c3c7cd"
    veil: float = 0.3
    bone: str = "#3d8fc4"
    joint: str = "#d1495b"
    ink: str = "#2b2f36"
    colormap: str = "viridis"
    picture: Path | None = None
