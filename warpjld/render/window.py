"""An off-screen window, with or without a display, that leaves the user's own pyvista settings alone."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from warpjld.errors import WarpjldError

if TYPE_CHECKING:
    import pyvista

__all__ = ["open_window"]

_CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
_LIBRARIES = {"libEGL.so.1": "vtkEGLRenderWindow", "libOSMesa.so.8": "vtkOSOpenGLRenderWindow"}


def open_window(size: tuple[int, int]) -> pyvista.Plotter:
    """A plotter of ``size`` pixels, without lights and smoothing.

    Pictures are drawn larger and averaged instead, which looks the same everywhere and is the faster way where a
    processor does the drawing.

    Raises:
        WarpjldError: No display, and none of the libraries that do without.
    """
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
    os.environ[_CHOICE] = _window_kind()
    try:
        yield
    finally:
        os.environ.pop(_CHOICE, None)


def _window_kind() -> str:
    for library, kind in _LIBRARIES.items():
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)
            return kind
    raise WarpjldError(
        "drawing without a display needs EGL or OSMesa, and neither is installed "
        "(Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri)"
    )
