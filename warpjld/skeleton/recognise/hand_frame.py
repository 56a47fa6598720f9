"""Frame of a hand (forward, radial, dorsal) and its chirality, from joint positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit

__all__ = ["HandFrame", "chirality", "hand_frame"]

Points = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class HandFrame:
    """Unit directions of a hand at rest.

    Attributes:
        forward: From the wrist to the knuckles.
        radial: Towards the thumb, perpendicular to ``forward``.
        dorsal: Outwards from the back of the hand.
    """

    forward: NDArray[np.float64]
    radial: NDArray[np.float64]
    dorsal: NDArray[np.float64]


def hand_frame(points: Points, side: str) -> HandFrame:
    """Directions of a hand whose side is known, from its finger bases and wrist."""
    forward, radial, normal = _palm(points)
    return HandFrame(forward, radial, normal if side == "right" else -normal)


def chirality(points: Points) -> float:
    """Positive for a right hand, negative for a left one; near zero where the rest pose is ambiguous.

    Fingers bend towards the palm, and the thumb lies in front of it: both tell the palmar from the dorsal side.
    """
    _, _, normal = _palm(points)
    bases = [points[f"{d}.base"] for d in ("index", "middle", "ring", "pinky") if f"{d}.base" in points]
    width = float(np.linalg.norm(bases[0] - bases[-1])) or 1.0
    bend, thumb = 0.0, 0.0
    for digit in ("index", "middle", "ring", "pinky"):
        chain = [points[f"{digit}.{j}"] for j in ("base", "knuckle2", "knuckle3", "tip") if f"{digit}.{j}" in points]
        if len(chain) >= 3:
            chord = np.linalg.norm(chain[-1] - chain[0])
            bulge = np.mean(chain[1:-1], axis=0) - (chain[0] + chain[-1]) / 2
            bend += float(bulge @ normal / chord)
    last = next((points[f"thumb.{j}"] for j in ("knuckle3", "knuckle2") if f"thumb.{j}" in points), None)
    if last is not None:
        thumb = -float((last - np.mean(bases, axis=0)) @ normal) / width
    return bend + thumb


def _palm(points: Points) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    bases = [points[f"{d}.base"] for d in ("index", "middle", "ring", "pinky") if f"{d}.base" in points]
    forward = unit(np.mean(bases, axis=0) - points["wrist"])
    radial = bases[0] - bases[-1]
    radial = unit(radial - forward * (forward @ radial))
    return forward, radial, np.cross(forward, radial)
