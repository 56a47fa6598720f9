"""Lights of a soft studio setup, fixed to the camera."""

from __future__ import annotations

from typing import Any

__all__ = ["add_lights"]

# position in the camera's frame (it is at z = 1 and looks at the origin), colour, intensity
_LIGHTS = (
    # key light from the upper left: three lamps, for soft shadows
    ((-0.2, 0.8, 1.0), "#fff4e8", 0.32),
    ((-0.9, 0.5, 0.9), "#fff4e8", 0.32),
    ((-0.8, 1.2, 0.2), "#fff4e8", 0.27),
    # fill light, cooler
    ((0.5, 0.0, 1.0), "#eef1ff", 0.23),
    ((1.0, 0.2, 0.4), "#e6ecff", 0.25),
    # rim light, from behind
    ((0.4, 0.9, -1.0), "#ffffff", 0.32),
    # light reflected by the floor
    ((-0.5, -1.0, 0.5), "#ffdcc8", 0.20),
)


def add_lights(plotter: Any) -> None:
    """Add the lights to a pyvista plotter."""
    import pyvista

    for position, color, intensity in _LIGHTS:
        light = pyvista.Light(position=position, light_type="camera light", color=color, intensity=intensity)
        plotter.add_light(light)
