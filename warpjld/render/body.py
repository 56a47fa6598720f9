"""A shaded mesh of constant topology inside a window, whose vertices and colours change by frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.render.creases import Shading
from warpjld.render.texture import MeshTexture

__all__ = ["MATTE", "SKIN", "RenderedBody"]

#: Materials for `RenderedBody.show`.
SKIN: dict[str, float] = {"ambient": 0.3, "diffuse": 0.8, "specular": 0.16, "specular_power": 14.0}
MATTE: dict[str, float] = {"ambient": 0.45, "diffuse": 0.75, "specular": 0.0}


class RenderedBody:
    """A mesh that is split along creases once, then positioned and coloured for every frame.

    Args:
        vertices: Positions in the first frame, by which creases are found [m], shape (n, 3).
        faces: Triangles, shape (t, 3).
        crease: Dihedral angle [rad] above which an edge is shown as sharp.
    """

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.integer], crease: float) -> None:
        import pyvista

        self._shading = Shading(vertices, faces, crease)
        points, normals = self._shading.place(vertices)
        self._mesh = pyvista.PolyData.from_regular_faces(points, self._shading.faces)
        self._mesh.point_data["Normals"] = normals
        self._mesh.point_data.active_normals_name = "Normals"
        self._copies: NDArray[np.int64] | None = None

    def show(self, plotter: Any, color: str | NDArray[np.uint8], **look: Any) -> None:
        """Add the mesh to a plotter.

        Args:
            plotter: A pyvista plotter.
            color: One colour, or a table of colours, shape (n, 3), to which the shares given to `paint` refer.
            look: Further options of ``Plotter.add_mesh``.
        """
        colored: dict[str, Any] = {"color": color}
        if not isinstance(color, str):
            from matplotlib.colors import ListedColormap

            self.paint(np.zeros(int(self._shading.origin.max()) + 1))
            # scalars are interpolated, not colours, so that intermediate values get the table's colours
            colored = {"scalars": "share", "clim": (0.0, 1.0), "cmap": ListedColormap(color / 255.0)}
            colored |= {"n_colors": len(color), "interpolate_before_map": True, "show_scalar_bar": False}
        # pyvista's own smooth shading would compute other normals
        actor = plotter.add_mesh(self._mesh, smooth_shading=False, **colored, **look)
        actor.prop.interpolation = "Phong"
        if isinstance(color, str):
            red, green, blue = actor.prop.color.float_rgb
            # warmer ambient light imitates subsurface scattering in skin
            actor.prop.ambient_color = (red, 0.84 * green, 0.78 * blue)

    def show_painted(self, plotter: Any, colors: NDArray[np.uint8], **look: Any) -> None:
        """Add it in a colour for each vertex, shape (n, 3)."""
        self._mesh.point_data["colors"] = colors[self._shading.origin]
        actor = plotter.add_mesh(self._mesh, smooth_shading=False, scalars="colors", rgb=True, **look)
        actor.prop.interpolation = "Phong"

    def show_textured(self, plotter: Any, texture: MeshTexture, **look: Any) -> None:
        """Add the surface with a texture."""
        import pyvista

        keyed = np.column_stack([self._shading.faces.ravel(), texture.corner_uv.reshape(-1, 2)])
        kinds, corner = np.unique(keyed, axis=0, return_inverse=True)
        self._copies = kinds[:, 0].astype(np.int64)
        faces, normals = corner.reshape(-1, 3).astype(np.int32), self._mesh.point_data["Normals"][self._copies]
        self._mesh = pyvista.PolyData.from_regular_faces(np.asarray(self._mesh.points)[self._copies], faces)
        self._mesh.point_data["Normals"] = normals
        self._mesh.point_data.active_normals_name = "Normals"
        self._mesh.active_texture_coordinates = kinds[:, 1:].astype(np.float32)
        picture = pyvista.Texture(np.ascontiguousarray(texture.image))
        actor = plotter.add_mesh(self._mesh, smooth_shading=False, texture=picture, color="white", **look)
        actor.prop.interpolation = "Phong"

    def place(self, vertices: NDArray[np.floating]) -> None:
        """Move the vertices to positions [m], shape (n, 3)."""
        points, normals = self._shading.place(vertices)
        if self._copies is not None:
            points, normals = points[self._copies], normals[self._copies]
        self._mesh.points, self._mesh.point_data["Normals"] = points, normals

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the bounding box [m], shape (8, 3)."""
        bounds = np.reshape(self._mesh.bounds, (3, 2))
        return np.stack(np.meshgrid(*bounds), axis=-1).reshape(-1, 3)

    def paint(self, shares: NDArray[np.floating]) -> None:
        """Colour the vertices by shares, shape (n,): 0 is the table's first colour, 1 its last."""
        self._mesh.point_data["share"] = shares[self._shading.origin]
