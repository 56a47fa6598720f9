"""Lights: a soft studio setup fixed to the camera, or lamps that stand on the stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["Lamp", "add_lights", "place_lamps"]

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


@dataclass(frozen=True)
class Lamp:
    """A lamp on the stage; it throws no shadows.

    Attributes:
        position: [m].
        target: What it shines at [m].
        color: Name or ``#rrggbb``.
        intensity: 1 is full.
        parallel: Whether it shines in one direction everywhere, as the sun does.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    color: str = "#ffffff"
    intensity: float = 1.0
    parallel: bool = False


def add_lights(plotter: Any, lamps: Sequence[Lamp] = ()) -> list[Any]:
    """Light a pyvista plotter: by lamps, which are returned as its own, or by studio light where there are none."""
    import pyvista

    if lamps:
        made = [pyvista.Light(light_type="scene light", positional=not lamp.parallel) for lamp in lamps]
        for light in made:
            light.cone_angle = 180.0  # in all directions
            plotter.add_light(light)
        place_lamps(made, lamps)
        return made
    for position, color, intensity in _LIGHTS:
        light = pyvista.Light(position=position, light_type="camera light", color=color, intensity=intensity)
        plotter.add_light(light)
    return []


def place_lamps(made: Sequence[Any], lamps: Sequence[Lamp]) -> None:
    """Let lamps of a plotter shine as they do now."""
    for light, lamp in zip(made, lamps, strict=True):
        light.position, light.focal_point = lamp.position, lamp.target
        light.intensity = lamp.intensity
        light.diffuse_color = light.specular_color = lamp.color
