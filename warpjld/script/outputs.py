"""Files a script asks for, and the camera they are taken with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = [
    "CameraSetting",
    "ContactSheet",
    "Export",
    "FilmOutput",
    "Grips",
    "MotionFile",
    "Output",
    "Picture",
    "PictureStyle",
    "Table",
    "TactileOutput",
    "Volume",
]

PictureStyle = Literal["shaded", "wireframe", "pressure"]


@dataclass(frozen=True)
class CameraSetting:
    """Where pictures are taken from: a named view, or a position and a target [m].

    With ``follow`` it goes along with the root of the first actor.
    """

    view: str | None = None
    position: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None
    zoom: float = 1.0
    follow: bool = False


@dataclass(frozen=True)
class Picture:
    """One frame as a PNG; coloured by pressure perhaps of one actor or object ``only``, or of its ``digits``; or with
    the ``numbers`` of all vertices and facets, or only its."""

    name: str
    frame: float
    style: PictureStyle
    camera: CameraSetting
    only: str | None = None
    digits: tuple[str, ...] = ()
    numbers: bool = False


@dataclass(frozen=True)
class FilmOutput:
    """All frames as a film; coloured by pressure perhaps of one actor or object ``only``, or of its ``digits``."""

    name: str
    style: PictureStyle
    camera: CameraSetting
    only: str | None = None
    digits: tuple[str, ...] = ()


@dataclass(frozen=True)
class ContactSheet:
    """Several frames on one PNG, each as wire-frame and shaded."""

    name: str
    frames: tuple[float, ...]
    camera: CameraSetting


@dataclass(frozen=True)
class Export:
    """The animated surface of one actor, or of all."""

    name: str
    actor: str | None


@dataclass(frozen=True)
class MotionFile:
    """The motion of one actor, or of all, on the joints of its rig's own file."""

    name: str
    actor: str | None


@dataclass(frozen=True)
class Table:
    """Forces, areas and pressures by frame and digit, as CSV or Parquet."""

    name: str


@dataclass(frozen=True)
class TactileOutput:
    """What the skin of an actor, or of the first whose flesh deforms, feels over time: CSV, Parquet or a plot."""

    name: str
    actor: str | None


@dataclass(frozen=True)
class Grips:
    """Grips that were searched for, and all that were tried, as CSV."""

    name: str


@dataclass(frozen=True)
class Volume:
    """The deformed volumes as a VTK series."""

    name: str


Output = Picture | FilmOutput | ContactSheet | Export | MotionFile | Table | TactileOutput | Grips | Volume
