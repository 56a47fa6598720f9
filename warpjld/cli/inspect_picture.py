"""Picture of ``warpjld inspect``: wire-frame, skeleton, and names of its joints."""

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.whole_file import whole_file
from warpjld.rig import Rig

__all__ = ["draw_rig"]

_BONE, _PALM, _SUSPECT = "#1f4e9c", "#c0501f", "#d01030"


def draw_rig(rig: Rig, path: Path, *, suspicious: Set[str] = frozenset()) -> None:
    """Write a PNG of the rest pose: a hand from its back and from the thumb's side, a body from the front and side.

    Args:
        rig: The rig.
        path: PNG file to write.
        suspicious: Names of joints to mark.

    Raises:
        InputError: It cannot be written.
    """
    import pyvista

    if path.suffix.lower() != ".png":
        raise InputError(f"pictures are PNG files, got '{path.suffix}'", path=path)
    if not path.parent.is_dir():
        raise InputError("the folder does not exist", path=path)
    skeleton, surface = rig.skeleton, rig.surface
    views = _views(rig)
    pyvista.vtk_verbosity("off")  # off-screen it complains about a missing display
    plotter = pyvista.Plotter(
        off_screen=True, shape=(1, len(views)), window_size=(1000 * len(views), 1200), border=False
    )
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    marked = np.array([name in suspicious for name in skeleton.names])
    named = _named(rig)
    for column, (towards, up) in enumerate(views):
        plotter.subplot(0, column)
        plotter.set_background("white")
        plotter.add_mesh(mesh, color="#d9b8a0", opacity=0.25, lighting=True)
        plotter.add_mesh(mesh, style="wireframe", color="#555555", opacity=0.18, line_width=0.6, lighting=False)
        for segment in skeleton.segments:
            line = pyvista.Line(skeleton.rest[segment.proximal], skeleton.rest[segment.distal])
            plotter.add_mesh(line, color=_PALM if segment.palm else _BONE, line_width=3)
        for choice, colour, size in ((~marked, "#101010", 8), (marked, _SUSPECT, 13)):
            if choice.any():
                dots = skeleton.rest[choice]
                plotter.add_points(dots, color=colour, point_size=size, render_points_as_spheres=True)
        plotter.add_point_labels(
            skeleton.rest[named],
            ["  " + _label(skeleton.names[j]) for j in named],
            font_size=13,
            shape_opacity=0.55,
            shape_color="white",
            text_color="#202020",
            always_visible=True,
            show_points=False,
            margin=1,
        )
        _aim(plotter, surface.vertices, towards, up)
    with whole_file(path) as part:
        plotter.screenshot(str(part))
    plotter.close()


def _views(rig: Rig) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Viewing directions, each with its up direction."""
    from warpjld.skeleton.recognise.hand_frame import hand_frame

    skeleton = rig.skeleton
    if len(skeleton.palms) == 1 and "pelvis" not in skeleton.names:
        side = skeleton.names[skeleton.palms[0][0][0]].partition(".")[0]
        points = {name.partition(".")[2]: p for name, p in zip(skeleton.names, skeleton.rest, strict=True)}
        frame = hand_frame(points, side)
        return [(frame.dorsal, frame.forward), (frame.radial, frame.forward)]
    y = np.array([0.0, 1.0, 0.0])
    return [(np.array([0.0, 0.0, 1.0]), y), (np.array([1.0, 0.0, 0.0]), y)]


def _named(rig: Rig) -> list[int]:
    """Joints to label: all of a hand; for a body not those of fingers and toes, whose labels would overlap."""
    names = rig.skeleton.names
    if "pelvis" not in names:
        return list(range(len(names)))
    return [j for j, name in enumerate(names) if name.count(".") < 2]


def _label(name: str) -> str:
    side, _, rest = name.partition(".")
    return rest.replace("carpometacarpal", "cmc") if side in ("left", "right") else name


def _aim(plotter: Any, vertices: NDArray[np.float64], towards: NDArray[np.float64], up: NDArray[np.float64]) -> None:
    across = np.cross(up, towards)
    spans = [vertices @ axis for axis in (across, up, towards)]
    centre = sum((s.max() + s.min()) / 2 * axis for s, axis in zip(spans, (across, up, towards), strict=True))
    half = max(float(np.ptp(spans[1])) / 2, float(np.ptp(spans[0])) / 2 * 1.2)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    camera = plotter.camera
    camera.position = centre + 3 * size * towards
    camera.focal_point = centre
    camera.up = up
    camera.parallel_projection = True
    camera.parallel_scale = 1.08 * half
    camera.clipping_range = (size, 6 * size)
