"""First view of a page: the camera's distance fits what is shown, in windows of any aspect ratio."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["FIELD", "distance_to_fit", "look"]

FIELD = 0.6
"""Vertical field of view of the camera [rad]."""
_MARGIN = 1.1  # of the distance: an empty border round what is shown
_SAME = 1e-4  # of the distance: difference between positions that a browser's rounding makes
_KEY = "_warpjld_first_view"  # attribute of a server: its view, which windows are given as long as nobody turns them


class _FirstView:
    """Keeps a server's windows fitted to points until their users move the camera."""

    def __init__(self, server: Any) -> None:
        self._server = server
        self._centre, self._direction, self._radius = np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0
        self._given: dict[int, NDArray[np.float64]] = {}
        server.on_client_connect(self._connected)
        server.on_client_disconnect(lambda client: self._given.pop(client.client_id, None))

    def show(self, centre: NDArray[np.float64], direction: NDArray[np.float64], radius: float) -> None:
        """Show a sphere [m] from a direction (a unit vector) in every window, and in those to come."""
        self._centre, self._direction, self._radius = centre, direction, radius
        first = self._server.initial_camera
        first.position, first.look_at = tuple(self._eye(1.0)), tuple(centre)
        for client in self._server.get_clients().values():
            self._give(client)

    def _eye(self, aspect: float) -> NDArray[np.float64]:
        return self._centre + distance_to_fit(self._radius, aspect) * self._direction

    def _connected(self, client: Any) -> None:
        self._given[client.client_id] = self._eye(1.0)
        self._follow(client.camera)
        client.camera.on_update(self._follow)

    def _follow(self, camera: Any) -> None:
        """Fit the distance to a window's new aspect ratio, unless the user has moved its camera."""
        given = self._given.get(camera.client.client_id)
        if given is None:
            return
        if np.linalg.norm(np.asarray(camera.position) - given) > _SAME * np.linalg.norm(given - self._centre):
            return
        if np.linalg.norm(self._eye(float(camera.aspect)) - given) > _SAME * np.linalg.norm(given - self._centre):
            self._give(camera.client)

    def _give(self, client: Any) -> None:
        eye = self._eye(float(client.camera.aspect))
        self._given[client.client_id] = eye
        with client.atomic():
            client.camera.position, client.camera.look_at = eye, self._centre


def distance_to_fit(radius: float, aspect: float) -> float:
    """Distance [m] from which a sphere fills a window, whichever of its angles of view is the narrower.

    Args:
        radius: Radius of the sphere [m].
        aspect: Width of the window by its height; the height's angle of view is ``FIELD``.
    """
    return radius / np.tan(FIELD / 2.0) / min(1.0, max(aspect, 0.1)) * _MARGIN


def look(server: Any, points: NDArray[np.floating], direction: tuple[float, float, float] = (0.45, 0.75, 0.5)) -> None:
    """Set the camera of every window so that points (n, 3) [m] fill the view from a direction.

    A window whose aspect ratio changes is fitted anew as long as its user has not moved the camera.
    """
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    if not hasattr(server, _KEY):
        setattr(server, _KEY, _FirstView(server))
    unit = np.array(direction) / np.linalg.norm(direction)
    getattr(server, _KEY).show((low + high) / 2.0, unit, float(np.linalg.norm(high - low)) / 2.0)
