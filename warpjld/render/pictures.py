"""Single pictures of a surface from plain arrays, shaded or as a wireframe."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from warpjld.render.camera import Camera
from warpjld.render.colors import ColorScale
from warpjld.render.scene import Image, SceneRenderer, Solid
from warpjld.render.style import Quality, Style

__all__ = ["shaded", "wireframe"]


def shaded(
    vertices: ArrayLike,
    faces: ArrayLike,
    camera: Camera,
    *,
    size: tuple[int, int] = (960, 720),
    values: ArrayLike | None = None,
    scale: ColorScale | None = None,
    solids: Sequence[Solid] = (),
    style: Style | None = None,
    quality: Quality | None = None,
) -> Image:
    """Draw a surface, smoothly shaded, or coloured by a number per vertex.

    Args:
        vertices: Welded positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        camera: See `Camera.view`.
        size: Width and height [pixels].
        values: Numbers to show as colours, shape (V,), e.g. stretch or distance.
        scale: Their colours; from their range if left out.
        solids: Objects beside the surface.
        style: Colours.
        quality: Effort.

    Returns:
        Picture, uint8 (height, width, 3).
    """
    style = style or Style()
    if values is not None and scale is None:
        scale = ColorScale.spanning(values, colormap=style.colormap)
    with SceneRenderer(
        faces, camera, size=size, solids=solids, scale=scale, style=style, quality=quality or Quality()
    ) as scene:
        return scene.draw(vertices, values=values)


def wireframe(
    vertices: ArrayLike,
    faces: ArrayLike,
    camera: Camera,
    *,
    joints: ArrayLike | None = None,
    segments: ArrayLike | None = None,
    size: tuple[int, int] = (960, 720),
    solids: Sequence[Solid] = (),
    style: Style | None = None,
    quality: Quality | None = None,
) -> Image:
    """Draw the edges of a surface with translucent skin and the skeleton inside (R5, R66–R67, Figs 12–15).

    Args:
        vertices: Welded positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        camera: See `Camera.view`.
        joints: Joint positions [m], shape (J, 3).
        segments: Proximal and distal joint of each segment, shape (B, 2).
        size: Width and height [pixels].
        solids: Objects beside the surface.
        style: Colours.
        quality: Effort.

    Returns:
        Picture, uint8 (height, width, 3).
    """
    with SceneRenderer(
        faces,
        camera,
        look="wireframe",
        size=size,
        segments=segments,
        solids=solids,
        style=style or Style(),
        quality=quality or Quality(),
    ) as scene:
        return scene.draw(vertices, joints=joints)
