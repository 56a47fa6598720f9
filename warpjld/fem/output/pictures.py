"""Pictures of a solution: the deformed body, whole and in section, coloured by displacement or stress."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.output.stress import at_nodes, cauchy, mises
from warpjld.fem.output.vtk import grid_of
from warpjld.fem.solver.solution import Instant
from warpjld.files.whole_file import whole_file
from warpjld.geometry.rotations import unit

__all__ = ["QUANTITIES", "draw"]

QUANTITIES = ("displacement", "stress")
_PANEL = 1000  # width and height of one view, pixels
_BAR = 260  # width of the colour bar, pixels


def draw(path: Path, body: Body, instant: Instant, quantity: str, title: str = "") -> None:
    """Write a PNG: the body from outside on the left, cut through its middle on the right, at true scale, with edges.

    Args:
        path: Image file to write.
        body: Mesh and laws.
        instant: The equilibrium.
        quantity: ``displacement`` (magnitude [mm]) or ``stress`` (von Mises [kPa]).
        title: Text above.
    """
    from PIL import Image

    moved = grid_of(body.mesh)
    moved.points = body.mesh.nodes + instant.displacement
    if quantity == "displacement":
        values, label = 1e3 * np.linalg.norm(instant.displacement, axis=1), "displacement, mm"
    else:
        values, label = 1e-3 * at_nodes(body, mises(cauchy(body, instant.displacement))), "von Mises stress, kPa"
    moved.point_data["value"] = values
    limits = _limits(values)
    front, up = _view(np.asarray(moved.points))
    middle = body.mesh.nodes[body.mesh.elements].mean(axis=1)
    behind = np.flatnonzero((middle - body.mesh.nodes.mean(axis=0)) @ front <= 0.0)
    panels = [
        _panel(moved, moved, limits, front, up, title),
        _panel(moved.extract_cells(behind), moved, limits, front, up, ""),
        _bar(moved, limits, label),
    ]
    sheet = Image.fromarray(np.concatenate(panels, axis=1))
    sheet = sheet.resize((2 * _PANEL + _BAR, _PANEL), Image.Resampling.LANCZOS)
    with whole_file(path) as part:
        sheet.save(part, format="PNG")


def _panel(
    shown: Any, whole: Any, limits: tuple[float, float], front: Array, up: Array, title: str
) -> NDArray[np.uint8]:
    import pyvista

    from warpjld.render.window import open_window

    plotter = open_window((2 * _PANEL, 2 * _PANEL))
    plotter.set_background("white")
    surface = shown.extract_surface(algorithm="dataset_surface")
    smooth = surface.compute_normals(cell_normals=False, split_vertices=True, feature_angle=40.0)
    plotter.add_mesh(
        smooth, scalars="value", cmap="viridis", clim=limits, show_scalar_bar=False, ambient=0.45, diffuse=0.6
    )
    plotter.add_mesh(surface.extract_all_edges(), color="#101010", line_width=1.5, opacity=0.35)
    centre, reach = np.asarray(whole.center), float(whole.length)
    side = np.cross(up, front)
    eye = front + 0.3 * up
    for direction, power in ((front + 0.7 * up + 0.5 * side, 0.8), (front - 0.5 * side, 0.4)):
        plotter.add_light(
            pyvista.Light(position=centre + 5 * reach * direction, light_type="scene light", intensity=power)
        )
    plotter.camera_position = [tuple(centre + 3 * reach * eye), tuple(centre), tuple(up)]
    plotter.enable_parallel_projection()
    right = unit(np.cross(up, eye))
    above = unit(np.cross(eye, right))
    spread = (np.asarray(whole.points) - centre) @ np.stack([right, above], axis=1)
    plotter.camera.parallel_scale = 1.12 * float(np.abs(spread).max())
    plotter.camera.clipping_range = (0.1 * reach, 10 * reach)
    if title:
        plotter.add_text(title, font_size=32, color="black", position="upper_left")
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def _bar(moved: Any, limits: tuple[float, float], label: str) -> NDArray[np.uint8]:
    from warpjld.render.window import open_window

    plotter = open_window((2 * _BAR, 2 * _PANEL))
    plotter.set_background("white")
    plotter.add_mesh(moved, scalars="value", cmap="viridis", clim=limits, opacity=0.0, show_scalar_bar=False)
    plotter.add_scalar_bar(
        label, n_labels=6, color="black", fmt="%.3g", vertical=True, position_x=0.1, position_y=0.15, height=0.7,
        width=0.5, title_font_size=34, label_font_size=46,
    )  # fmt: skip
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def _limits(values: Array) -> tuple[float, float]:
    """Range of the colours: half a percent of values may saturate at either end, since stress peaks at single nodes."""
    low, high = (float(p) for p in np.percentile(values, [0.5, 99.5]))
    return (low, high) if high > low else (low, low + 1.0)


def _view(points: Array) -> tuple[Array, Array]:
    """Viewing direction and up vector: across the longest and shortest extents, z up unless the body lies along z."""
    extent = np.ptp(points, axis=0)
    if extent[2] > 1.5 * extent[:2].max():
        return np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    front = np.zeros(3)
    front[int(np.argmin(extent[:2] + np.array([1e-9 * extent.max(), 0.0])))] = -1.0
    return front, np.array([0.0, 0.0, 1.0])
