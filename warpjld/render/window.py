"""Off-screen window, with or without a display, independent of the user's own pyvista settings."""

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
    """A plotter of ``size`` pixels, without lights and multisampling.

    Pictures are supersampled instead, which gives the same result everywhere and is faster with software rendering.

    Raises:
        WarpjldError: There is neither a display nor a library for rendering without one.
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
    """Select a render window that needs no display where there is none: by default VTK tries X first, and warns."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or _CHOICE in os.environ:
        yield
        return
    os.environ[_CHOICE] = _window_kind()
    try:
        yield
    finally:
        os.environ.pop(_CHOICE, None)


def _window_kind() -> str:
    """VTK's class of render window for the first library that is installed."""
    for library, kind in _LIBRARIES.items():
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)
            return kind
    raise WarpjldError(
        "drawing without a display needs EGL or OSMesa, and neither is installed "
        "(Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri)"
    )
