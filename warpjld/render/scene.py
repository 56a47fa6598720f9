"""Renderer of many pictures of a moving surface: the window is built once, then only vertices change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.render.backdrop import before_picture
from warpjld.render.body import MATTE, SKIN, RenderedBody
from warpjld.render.camera import Camera
from warpjld.render.colors import ColorScale, as_hex
from warpjld.render.lights import Lamp, add_lights, place_lamps
from warpjld.render.occlusion import occlusion, shade
from warpjld.render.skeleton import bone_faces, bone_vertices, joint_faces, joint_vertices
from warpjld.render.style import Quality, Style
from warpjld.render.texture import MeshTexture
from warpjld.render.wires import Wires

__all__ = ["Image", "Look", "SceneRenderer", "Solid"]

#: Picture, uint8 (height, width, 3).
Image = NDArray[np.uint8]
#: ``shaded``, or ``wireframe``: edges with translucent skin and the skeleton inside (R5, Figs 12–15).
Look = Literal["shaded", "wireframe"]

# radius of ambient occlusion relative to the diagonal of the bounding box
_REACH = 0.09
# depth behind the drawn surface from which a point counts as hidden, likewise
_HIDDEN = 2e-3
# dihedral angles [rad] above which an edge is shown as sharp
_SKIN_CREASE, _SOLID_CREASE, _BONE_CREASE = 1.15, 0.7, 0.6


@dataclass(frozen=True, eq=False)
class Solid:
    """An object in addition to the surface, for example one that is grasped.

    Attributes:
        vertices: Positions [m], shape (n, 3); those of a moving object are given to `SceneRenderer.draw`.
        faces: Triangles, shape (t, 3).
        color: Name or ``#rrggbb``, see `as_hex`.
        opacity: 0…1.
        texture: Texture, which replaces the colour.
    """

    vertices: ArrayLike
    faces: ArrayLike
    color: str = "#7fa3b8"
    opacity: float = 1.0
    texture: MeshTexture | None = None

    def __post_init__(self) -> None:
        as_hex(self.color)


class SceneRenderer:
    """Draws frames of one surface; use it in a ``with`` statement, or `close` it.

    Args:
        faces: Triangles over the welded vertices, shape (T, 3).
        camera: The camera, see `Camera.view`.
        look: Kind of picture.
        size: Width and height [pixels].
        segments: Proximal and distal joint of each bone to draw, shape (B, 2); joints come with each frame.
            In shaded pictures bones show only where the style makes the skin translucent.
        solids: Other objects.
        scale: Colours for the values that come with each frame.
        colors: Colours of the vertices instead of the style's, uint8 (V, 3).
        texture: Texture of the surface, which replaces colours.
        lamps: On the stage, instead of studio light.
        style: Colours.
        quality: Effort.

    Raises:
        InputError: Wrong shapes, or a picture too small or large.
    """

    def __init__(
        self,
        faces: ArrayLike,
        camera: Camera,
        *,
        look: Look = "shaded",
        size: tuple[int, int] = (960, 720),
        segments: ArrayLike | None = None,
        solids: Sequence[Solid] = (),
        scale: ColorScale | None = None,
        colors: NDArray[np.uint8] | None = None,
        texture: MeshTexture | None = None,
        lamps: Sequence[Lamp] = (),
        style: Style | None = None,
        quality: Quality | None = None,
    ) -> None:
        self._colors, self._texture, self._lamps = colors, texture, tuple(lamps)
        self._faces = np.asarray(faces)
        if self._faces.ndim != 2 or self._faces.shape[1] != 3 or (len(self._faces) == 0 and not solids):
            raise InputError(f"faces: want shape (n, 3) with n > 0, got {self._faces.shape}")
        if look not in ("shaded", "wireframe"):
            raise InputError(f"look: want 'shaded' or 'wireframe', got '{look}'")
        if min(size) < 16 or max(size) > 8192:
            raise InputError(f"size: want 16…8192 pixels, got {size[0]} × {size[1]}")
        self._camera, self._size, self._wire = camera, size, look == "wireframe"
        self._pairs = np.zeros((0, 2), int) if segments is None else np.asarray(segments, int).reshape(-1, 2)
        self._solids, self._scale = tuple(solids), scale
        self._style, self._quality = style or Style(), quality or Quality()
        self._plotter: Any = None
        self._made: list[Any] = []
        self.look(camera)
        self._skin: RenderedBody | None = None
        self._wires: Wires | None = None

    def look(self, camera: Camera) -> None:
        """Take the frames that follow from elsewhere."""
        self._camera = camera
        # distance of the picture plane [pixels]
        self._focal = 0.5 * self._size[1] * camera.zoom / float(np.tan(camera.angle / 2))
        if self._plotter is not None:
            self._aim()

    def light(self, lamps: Sequence[Lamp]) -> None:
        """Let the lamps, as many as there are, shine otherwise in the frames that follow."""
        self._lamps = tuple(lamps)
        if self._plotter is not None:
            place_lamps(self._made, self._lamps)

    def draw(
        self,
        vertices: ArrayLike,
        *,
        joints: ArrayLike | None = None,
        values: ArrayLike | None = None,
        solids: Sequence[ArrayLike | None] = (),
    ) -> Image:
        """Draw one frame.

        Args:
            vertices: Positions [m], shape (V, 3).
            joints: Joint positions [m], shape (J, 3), where segments are drawn.
            values: A number per vertex to show as colour, shape (V,), where a scale was given.
            solids: New positions of the solids, in their order; None keeps the last.

        Returns:
            Picture, uint8 (height, width, 3).

        Raises:
            InputError: An array that is missing, of the wrong shape, or not finite.
        """
        points = _finite("vertices", vertices, (None, 3))
        if len(points) <= self._faces.max(initial=-1):
            raise InputError(f"vertices: want at least {self._faces.max() + 1} for these faces, got {len(points)}")
        bones = self._bones_from(joints)
        shares = self._shares_from(values, len(points))
        if self._plotter is None:
            self._build(points, bones)
        if self._skin is not None:
            self._skin.place(points)
        if shares is not None and self._skin is not None:
            self._skin.paint(shares)
        if self._wires is not None:
            self._wires.place(points, self._camera.position)
        if bones is not None:
            self._bones.place(bone_vertices(bones, self._pairs, self._thickness))
            self._balls.place(joint_vertices(bones[self._jointed], 0.45 * self._thickness))
        for body, solid, moved in zip(self._bodies, self._solids, solids, strict=False):
            if moved is not None:
                body.place(_finite("solids", moved, (len(np.asarray(solid.vertices)), 3)))
        self._clip(np.concatenate([points, *(body.corners for body in self._bodies)]))
        return self._shoot()

    def seen(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Positions of points (n, 3) [m] on the picture drawn last [pixels], shape (n, 2), and which of them are
        visible, shape (n,)."""
        cloud = _finite("points", points, (None, 3))
        if self._plotter is None:
            raise InputError("seen: draw a frame first")
        camera, (width, height) = self._camera, self._size
        ahead = unit(np.subtract(camera.target, camera.position))
        right = unit(np.cross(ahead, camera.up))
        away = cloud - camera.position
        depth = away @ ahead
        scale = self._focal / np.where(depth > 0.0, depth, 1.0)
        places = np.stack([away @ right * scale, away @ np.cross(ahead, right) * scale], axis=1)
        places += 0.5 * np.array([width, height])
        within = (depth > 0.0) & (places >= 0.0).all(axis=1) & (places < [width, height]).all(axis=1)
        times = self._quality.supersampling
        drawn = -self._plotter.get_image_depth(fill_value=np.nan, reset_camera_clipping_range=False)
        drawn = np.pad(np.where(np.isnan(drawn), np.inf, drawn)[::times, ::times], 1, mode="edge")
        column, row = np.where(within, places.T, 0.0).astype(np.int64)
        # farthest of the 3 × 3 pixels around: at silhouettes and on slopes the point's own pixel may be nearer
        around = np.max([drawn[row + dy, column + dx] for dy in range(3) for dx in range(3)], axis=0)
        return places, within & (depth <= around + _HIDDEN * self._extent)

    def close(self) -> None:
        """Close the window; drawing again opens another."""
        if self._plotter is not None:
            self._plotter.close()
            self._plotter = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _bones_from(self, joints: ArrayLike | None) -> NDArray[np.float64] | None:
        """Checked joint positions; None where no segments are drawn."""
        if not len(self._pairs):
            return None
        if joints is None:
            raise InputError("joints: want positions with each frame, since segments are drawn")
        bones = _finite("joints", joints, (None, 3))
        low, high = self._pairs.min(), self._pairs.max()
        if low < 0 or high >= len(bones):
            raise InputError(f"segments: joints are 0…{len(bones) - 1}, got {low}…{high}")
        return bones

    def _shares_from(self, values: ArrayLike | None, count: int) -> NDArray[np.float64] | None:
        """Checked values as positions on the colour scale; None without a scale."""
        if (values is None) != (self._scale is None):
            raise InputError("values: want them with each frame if a scale is given, and only then")
        if values is None or self._scale is None:
            return None
        return self._scale.shares(_finite("values", values, (count,)))

    def _build(self, points: NDArray[np.float64], joints: NDArray[np.float64] | None) -> None:
        """Open the window, and add lights, surface, edges, skeleton and solids to it."""
        from warpjld.render.window import open_window

        style, times = self._style, self._quality.supersampling
        shown = points if len(points) else np.concatenate([np.asarray(s.vertices, float) for s in self._solids])
        extent = float(np.linalg.norm(np.ptp(shown, axis=0)))
        self._plotter = open_window((self._size[0] * times, self._size[1] * times))
        self._plotter.set_background(style.background[0], top=style.background[1])
        self._made = add_lights(self._plotter, self._lamps)

        self._skin = RenderedBody(points, self._faces, _SKIN_CREASE) if len(self._faces) else None
        opacity = style.veil if self._wire else style.opacity
        if opacity > 0 and self._skin is not None:
            # only the front layer of translucent skin is drawn, so that no depth sorting is needed
            culling = "back" if opacity < 1 else False
            color = self._scale.table() if self._scale else style.skin
            look: dict[str, Any] = {"opacity": opacity, "culling": culling}
            look |= MATTE if self._wire or self._scale else SKIN
            if self._texture is not None and not self._scale and not self._wire:
                self._skin.show_textured(self._plotter, self._texture, **look)
            elif self._colors is not None and not self._scale and not self._wire:
                self._skin.show_painted(self._plotter, self._colors, **look)
            else:
                self._skin.show(self._plotter, color, **look)
        self._wires = None
        if self._wire and self._skin is not None:
            distance = float(np.linalg.norm(np.subtract(self._camera.target, self._camera.position)))
            width, unit = times * self._size[1] / 720, self._focal / distance
            self._wires = Wires(points, self._faces)
            self._wires.show(self._plotter, style.line, style.hidden_line, width=width, unit=unit)
        if joints is not None:
            self._thickness = 0.016 * extent
            self._jointed = np.unique(self._pairs)
            bones = bone_vertices(joints, self._pairs, self._thickness)
            self._bones = RenderedBody(bones, bone_faces(len(self._pairs)), _BONE_CREASE)
            self._bones.show(self._plotter, style.bone, **SKIN)
            self._balls = RenderedBody(
                joint_vertices(joints[self._jointed], 1.0), joint_faces(len(self._jointed)), np.pi
            )
            self._balls.show(self._plotter, style.joint, **SKIN)
        self._bodies = [
            RenderedBody(np.asarray(s.vertices, float), np.asarray(s.faces), _SOLID_CREASE) for s in self._solids
        ]
        for solid, body in zip(self._solids, self._bodies, strict=True):
            if solid.texture is not None:
                body.show_textured(self._plotter, solid.texture, opacity=solid.opacity, **SKIN)
            else:
                body.show(self._plotter, solid.color, opacity=solid.opacity, **SKIN)
        self._extent, self._occluded = extent, self._quality.occlusion and not self._wire and opacity == 1
        self._aim()

    def _aim(self) -> None:
        camera, wanted = self._plotter.camera, self._camera
        camera.position, camera.focal_point, camera.up = wanted.position, wanted.target, wanted.up
        camera.view_angle = float(np.degrees(wanted.angle)) / wanted.zoom

    def _clip(self, points: NDArray[np.floating]) -> None:
        """Set the clipping range from the points of this frame. VTK would use the bounds of the frame before, and
        pictures would depend on their order."""
        eye, target = np.asarray(self._camera.position), np.asarray(self._camera.target)
        depths = (points - eye) @ (target - eye) / np.linalg.norm(target - eye)
        far = max(1.1 * float(depths.max()), 1e-6)
        self._plotter.camera.clipping_range = (max(0.9 * float(depths.min()), 1e-3 * far), far)

    def _shoot(self) -> Image:
        """Render the window: supersampled, with ambient occlusion and colour bar."""
        from PIL import Image as Pictures

        self._plotter.render()
        picture = self._plotter.screenshot(return_img=True)
        if self._style.picture is not None:
            empty = np.isnan(self._plotter.get_image_depth(fill_value=np.nan, reset_camera_clipping_range=False))
            picture = before_picture(picture, empty, self._style.picture)
        times = self._quality.supersampling
        if times > 1:
            picture = np.asarray(Pictures.fromarray(picture).reduce(times))
        if self._occluded:
            depth = -self._plotter.get_image_depth(fill_value=np.nan, reset_camera_clipping_range=False)
            picture = shade(picture, occlusion(depth[::times, ::times], self._focal, _REACH * self._extent))
        if self._scale is not None:
            picture = self._scale.drawn_on(picture, self._style.ink)
        return np.ascontiguousarray(picture, np.uint8)


def _finite(name: str, array: ArrayLike, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """An array as float64; InputError where its shape (None matches any length) is wrong or it is not finite."""
    result = np.asarray(array, np.float64)
    if result.ndim != len(shape) or any(w not in (None, g) for w, g in zip(shape, result.shape, strict=True)):
        want = ", ".join("n" if size is None else str(size) for size in shape)
        raise InputError(f"{name}: want shape ({want}{',' * (len(shape) == 1)}), got {result.shape}")
    if not np.isfinite(result).all():
        raise InputError(f"{name}: entry {np.argwhere(~np.isfinite(result))[0].tolist()} is not finite")
    return result
