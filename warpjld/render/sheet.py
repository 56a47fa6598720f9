"""Grids of pictures with captions, and contact sheets of key frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.render.camera import Camera
from warpjld.render.scene import Image, Look, SceneRenderer, Solid
from warpjld.render.style import Quality, Style
from warpjld.render.text import font, write

__all__ = ["contact_sheet", "grid"]

_PAPER = "#ffffff"


def grid(
    rows: Sequence[Sequence[Image]],
    *,
    captions: Sequence[str] = (),
    row_captions: Sequence[str] = (),
    title: str = "",
    style: Style | None = None,
) -> Image:
    """Pictures of one size in rows; one row is a side-by-side comparison.

    Args:
        rows: Pictures, each uint8 (height, width, 3); the last row may be shorter.
        captions: Captions under the columns.
        row_captions: Captions left of the rows.
        title: Title above the pictures.
        style: Colours.

    Returns:
        Picture, uint8 (height, width, 3), of even height and width.

    Raises:
        InputError: No picture, or pictures of different sizes.
    """
    from PIL import Image as Pictures

    style = style or Style()
    pictures = [picture for row in rows for picture in row]
    if not pictures:
        raise InputError("grid: want at least one picture")
    shape = pictures[0].shape
    if any(picture.shape != shape for picture in pictures):
        raise InputError(f"grid: want pictures of one size, got {sorted({p.shape[:2] for p in pictures})}")
    height, width = shape[:2]
    columns = max(len(row) for row in rows)
    size = round(9 + min(height, width) / 60)
    gap = max(2, size // 3)
    head = 3 * size if title else gap
    foot = 2 * size if captions else gap
    left = gap
    if row_captions:
        left += size + max(round(font(size).getlength(text)) for text in row_captions)
    total = (left + columns * (width + gap), head + len(rows) * (height + gap) - gap + foot)
    canvas = Pictures.new("RGB", tuple(side + side % 2 for side in total), _PAPER)
    for i, row in enumerate(rows):
        for k, picture in enumerate(row):
            canvas.paste(Pictures.fromarray(picture), (left + k * (width + gap), head + i * (height + gap)))
    for k, text in enumerate(captions):
        _fit(canvas, (left + k * (width + gap) + width / 2, total[1] - foot / 2), text, size, style.ink, width)
    for i, text in enumerate(row_captions):
        middle = head + i * (height + gap) + height / 2
        write(canvas, (left - gap - size / 3, middle), text, size=size, color=style.ink, anchor="rm")
    if title:
        _fit(canvas, (total[0] / 2, head / 2), title, round(1.25 * size), style.ink, total[0])
    return np.asarray(canvas)


def contact_sheet(
    vertices: ArrayLike,
    faces: ArrayLike,
    camera: Camera,
    *,
    joints: ArrayLike | None = None,
    segments: ArrayLike | None = None,
    solids: Sequence[Solid] = (),
    moved: Sequence[Sequence[ArrayLike]] | None = None,
    numbers: Sequence[int] | None = None,
    looks: Sequence[Look] = ("wireframe", "shaded"),
    columns: int = 6,
    size: tuple[int, int] = (300, 380),
    title: str = "",
    style: Style | None = None,
    quality: Quality | None = None,
) -> Image:
    """Grid of key frames, wireframe above shaded, with their frame numbers (Figs 12–15).

    Args:
        vertices: Welded positions of the chosen frames [m], shape (F, V, 3).
        faces: Triangles, shape (T, 3).
        camera: Camera framed for all of them, see `Camera.view`; give it the ``size`` of one picture.
        joints: Joint positions of the same frames [m], shape (F, J, 3).
        segments: Proximal and distal joint of each segment, shape (B, 2).
        solids: Objects beside the surface.
        moved: Vertices of every object in every frame [m], where they move.
        numbers: Frame numbers for the captions; 0, 1, … if left out.
        looks: Kinds of picture, one above the other.
        columns: Frames side by side; further frames continue below.
        size: Width and height of one picture [pixels].
        title: Title above the pictures.
        style: Colours.
        quality: Effort.

    Returns:
        Picture, uint8 (height, width, 3).

    Raises:
        InputError: Arrays whose numbers of frames differ, or fewer than one column.
    """
    frames = np.asarray(vertices, np.float64)
    if frames.ndim != 3 or len(frames) == 0:
        raise InputError(f"vertices: want shape (frames, n, 3), got {frames.shape}")
    bones = None if joints is None else np.asarray(joints, np.float64)
    if bones is not None and len(bones) != len(frames):
        raise InputError(f"joints: want {len(frames)} frames, as many as of vertices, got {len(bones)}")
    names = [str(number) for number in (range(len(frames)) if numbers is None else numbers)]
    if len(names) != len(frames):
        raise InputError(f"numbers: want {len(frames)}, one a frame, got {len(names)}")
    if columns < 1:
        raise InputError(f"columns: want 1 or more, got {columns}")
    if moved is not None and len(moved) != len(frames):
        raise InputError(f"moved: want {len(frames)} frames, as many as of vertices, got {len(moved)}")
    style, quality = style or Style(), quality or Quality()
    strips: list[list[Image]] = []
    for look in looks:
        boned = bones is not None and segments is not None and look == "wireframe"
        drawn = segments if boned else None
        with SceneRenderer(
            faces, camera, look=look, size=size, segments=drawn, solids=solids, style=style, quality=quality
        ) as scene:
            strip = [
                scene.draw(
                    points,
                    joints=None if bones is None else bones[f],
                    solids=() if moved is None else moved[f],
                )
                for f, points in enumerate(frames)
            ]
        strips.append(strip)
    rows = []
    for first in range(0, len(frames), columns):
        for strip in strips:
            cells = strip[first : first + columns]
            rows.append([_numbered(cell, names[first + k], style) for k, cell in enumerate(cells)])
    return grid(rows, title=title, style=style)


def _numbered(picture: Image, text: str, style: Style) -> Image:
    """The picture with a frame number in its lower left corner."""
    from PIL import Image as Pictures

    size = max(10, round(picture.shape[0] / 24))
    canvas = Pictures.fromarray(picture.copy())
    write(canvas, (0.6 * size, picture.shape[0] - size), text, size=size, color=style.ink, anchor="lm")
    return np.asarray(canvas)


def _fit(canvas: object, place: tuple[float, float], text: str, size: int, color: str, width: int) -> None:
    """Write centred text, in a smaller size where it is wider than ``width`` [pixels]."""
    length = font(size).getlength(text)
    if length > 0.96 * width:
        size = max(8, int(size * 0.96 * width / length))
    write(canvas, place, text, size=size, color=color)
