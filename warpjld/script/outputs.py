"""Specifications of a script's output files, and of cameras."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = [
    "CameraKey",
    "CameraSetting",
    "ContactSheet",
    "Export",
    "FilmOutput",
    "Grips",
    "MotionFile",
    "Output",
    "Picture",
    "PictureStyle",
    "Shot",
    "Table",
    "TactileOutput",
    "Volume",
]

PictureStyle = Literal["shaded", "wireframe", "pressure"]


@dataclass(frozen=True)
class CameraKey:
    """Key of a camera: position and target [m], zoom, roll [rad], and spline constants (tension, continuity, bias)."""

    frame: float
    position: tuple[float, float, float]
    target: tuple[float, float, float]
    zoom: float
    roll: float
    spline: tuple[float, float, float]


@dataclass(frozen=True)
class CameraSetting:
    """Camera of pictures and films: a named view, or position and target [m] with a roll about the line of sight [rad].

    With ``follow`` it moves with the root of the first actor; with ``keys`` it is animated.
    """

    view: str | None = None
    position: tuple[float, float, float] | None = None
    target: tuple[float, float, float] | None = None
    zoom: float = 1.0
    follow: bool = False
    roll: float = 0.0
    keys: tuple[CameraKey, ...] = ()


@dataclass(frozen=True)
class Shot:
    """A range of frames, both included, with its camera."""

    name: str
    first: int
    last: int
    camera: CameraSetting


@dataclass(frozen=True)
class Picture:
    """One frame as a PNG.

    Style ``pressure`` colours all bodies, or one actor or object ``only``, or ``digits`` of it. With ``numbers``,
    vertices and facets (of ``only``, or of all) are labelled.
    """

    name: str
    frame: float
    style: PictureStyle
    camera: CameraSetting
    only: str | None = None
    digits: tuple[str, ...] = ()
    numbers: bool = False


@dataclass(frozen=True)
class FilmOutput:
    """A film of all frames, or of ``shots`` with their cameras; ``only`` and ``digits`` as for ``Picture``."""

    name: str
    style: PictureStyle
    camera: CameraSetting
    only: str | None = None
    digits: tuple[str, ...] = ()
    shots: tuple[Shot, ...] = ()


@dataclass(frozen=True)
class ContactSheet:
    """A contact sheet: several frames on one PNG, each as wire-frame and shaded."""

    name: str
    frames: tuple[float, ...]
    camera: CameraSetting


@dataclass(frozen=True)
class Export:
    """The animated surface of one actor, or of all actors and objects."""

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
    """Tactile signals of an actor (None: the first with deformable flesh) over time: CSV, Parquet or a plot."""

    name: str
    actor: str | None


@dataclass(frozen=True)
class Grips:
    """Results of grip searches with all trials, as CSV."""

    name: str


@dataclass(frozen=True)
class Volume:
    """The deformed volumes as a VTK series."""

    name: str


Output = Picture | FilmOutput | ContactSheet | Export | MotionFile | Table | TactileOutput | Grips | Volume
