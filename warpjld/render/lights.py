"""Soft studio light that moves with the camera."""

from __future__ import annotations

from typing import Any

__all__ = ["add_lights"]

# position seen from the camera (it sits at z = 1 and looks at the origin), colour, intensity
_LIGHTS = (
    # the key from the upper left is broad: three lamps give it a soft border
    ((-0.2, 0.8, 1.0), "#fff4e8", 0.32),
    ((-0.9, 0.5, 0.9), "#fff4e8", 0.32),
    ((-0.8, 1.2, 0.2), "#fff4e8", 0.27),
    # fill, cooler
    ((0.5, 0.0, 1.0), "#eef1ff", 0.23),
    ((1.0, 0.2, 0.4), "#e6ecff", 0.25),
    # rim, from behind
    ((0.4, 0.9, -1.0), "#ffffff", 0.32),
    # what the floor throws back
    ((-0.5, -1.0, 0.5), "#ffdcc8", 0.20),
)


def add_lights(plotter: Any) -> None:
    """Light a pyvista plotter."""
    import pyvista

    for position, color, intensity in _LIGHTS:
        light = pyvista.Light(position=position, light_type="camera light", color=color, intensity=intensity)
        plotter.add_light(light)
