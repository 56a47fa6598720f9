"""How things look: colours, materials and how much work a picture is worth."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.errors import InputError

__all__ = ["Quality", "Style"]


@dataclass(frozen=True)
class Quality:
    """Effort a picture.

    Attributes:
        supersampling: The picture is drawn this many times larger in both directions, then averaged.
        occlusion: Darken creases and contacts (ambient occlusion).
    """

    supersampling: int = 2
    occlusion: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.supersampling <= 8:
            raise InputError(f"supersampling: want 1…8, got {self.supersampling}")

    @classmethod
    def film(cls) -> Quality:
        """Several times faster, for many frames: edges as smooth, without occlusion."""
        return cls(occlusion=False)

    @classmethod
    def draft(cls) -> Quality:
        """Fastest; edges show their pixels."""
        return cls(supersampling=1, occlusion=False)


@dataclass(frozen=True)
class Style:
    """Colours as names or ``#rrggbb``.

    Attributes:
        skin: The surface's colour where it is not coloured by values.
        opacity: Of the skin in shaded pictures.
        background: Bottom and top of the background.
        line: Wire-frame edges that face the camera.
        hidden_line: Wire-frame edges that face away.
        veil: Opacity of the skin in wire-frame pictures.
        bone: Segments of the skeleton.
        joint: Its joints.
        ink: Captions.
        colormap: Matplotlib's name of the colours for values.
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
