"""viser server with access control, without console output, and with scene lighting; adding surfaces to it."""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import MissingExtraError
from warpjld.page.colored_glb import colored_glb
from warpjld.page.first_view import FIELD
from warpjld.page.guard import RequestGuard, guarding
from warpjld.page.visible_side import visible_side

__all__ = ["add_colored", "add_surface", "guarded_server", "rgb", "stop"]


def guarded_server(guard: RequestGuard, port: int, purpose: str) -> Any:
    """viser server on the guard's host, at a port or the next free one (0: any), with an empty scene.

    Raises:
        MissingExtraError: viser is not installed.
    """
    try:
        import viser
        from viser import _messages
    except ImportError:
        raise MissingExtraError(purpose, "studio") from None
    with guarding(guard), redirect_stdout(StringIO()):  # viser prints its addresses, without the token
        server = viser.ViserServer(host=guard.host, port=port, verbose=False)
    # viser's button for a public tunnel is hidden; messages that ask for one must be ignored as well
    server._websock_server.unregister_handler(_messages.ShareUrlRequest)
    _light(server)
    server.scene.set_up_direction("+y")
    server.scene.world_axes.visible = False
    server.initial_camera.fov = FIELD
    server.initial_camera.near = 0.005
    return server


def stop(server: Any) -> None:
    """Stop the server without console output."""
    with redirect_stdout(StringIO()):
        server.stop()


def add_surface(
    server: Any,
    name: str,
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    color: str,
    *,
    wireframe: bool = False,
    opacity: float | None = None,
) -> Any:
    """Add a surface of one colour; its ``vertices`` can be changed later. Back faces of closed ones are not drawn."""
    return server.scene.add_mesh_simple(
        name,
        vertices,
        faces.astype(np.uint32),
        color=rgb(color),
        wireframe=wireframe,
        opacity=opacity,
        side="double" if wireframe or opacity is not None else visible_side(vertices, faces),
        cast_shadow=False,
        receive_shadow=False,
    )


def add_colored(
    server: Any, name: str, vertices: NDArray[np.float32], faces: NDArray[np.int32], colors: NDArray[np.uint8]
) -> Any:
    """Add a surface with vertex colours; adding it again replaces it."""
    return server.scene.add_glb(name, colored_glb(vertices, faces, colors), cast_shadow=False, receive_shadow=False)


def rgb(color: str) -> tuple[int, int, int]:
    """Red, green and blue of ``#rrggbb``."""
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)


def _light(server: Any) -> None:
    """Add ambient light and two lamps without shadows: one from above, and one from below that lights the palm.

    Each further lamp lowers the frame rate of a browser without a graphics card by a tenth.
    """
    scene = server.scene
    scene.configure_environment_map(None)
    scene.configure_default_lights(False)
    scene.add_light_hemisphere("/light/sky", sky_color=(255, 250, 244), ground_color=(128, 112, 120), intensity=1.3)
    scene.add_light_directional("/light/lamp", intensity=2.6, position=(-0.7, 1.8, 1.0))
    scene.add_light_directional("/light/below", intensity=1.6, position=(1.0, -1.5, -0.3))
