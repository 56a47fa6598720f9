"""An off-screen window, with or without a display, that leaves the user's own pyvista settings alone."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyvista

__all__ = ["open_window"]

_CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"


def open_window(size: tuple[int, int]) -> pyvista.Plotter:
    """A plotter of ``size`` pixels, without lights and smoothing: pictures are drawn larger and averaged instead,
    which looks the same everywhere and is the faster way where a processor does the drawing."""
    import pyvista

    theme = pyvista.themes.Theme()
    theme.multi_samples = 1
    with _without_display():
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none", theme=theme)
        plotter.render_window.SetMultiSamples(0)
        return plotter


@contextlib.contextmanager
def _without_display() -> Iterator[None]:
    """Where there is no display VTK tries X first and warns; name the window that needs none."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or _CHOICE in os.environ:
        yield
        return
    os.environ[_CHOICE] = "vtkEGLRenderWindow"
    try:
        yield
    finally:
        os.environ.pop(_CHOICE, None)
