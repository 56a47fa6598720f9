"""Coarse controls of a hand's pose: amounts of curl, spread, opposition and cupping."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["COARSE", "coarse_angles", "coarse_share", "mixed", "of_side", "on_side"]

_FLEXIONS = {"base": 84.0, "knuckle2": 98.0, "knuckle3": 70.0}
COARSE: dict[str, dict[str, float]] = {
    "curl": {
        f"{digit}.{joint}.flexion": degrees
        for digit in ("index", "middle", "ring", "pinky")
        for joint, degrees in _FLEXIONS.items()
    },
    "spread": {
        "index.base.abduction": 18.0,
        "ring.base.abduction": -12.0,
        "pinky.base.abduction": -20.0,
        "thumb.base.flexion": -18.0,
    },
    "opposition": {"thumb.base.pivot": 30.0, "thumb.base.abduction": 26.0, "thumb.knuckle2.flexion": 20.0},
    "cup": {"ring.carpometacarpal.flexion": 14.0, "pinky.carpometacarpal.flexion": 20.0},
}
"""For each control, the channels' angles [degrees] at amount 1; chosen by hand."""


def coarse_angles(name: str, share: float, side: str) -> dict[str, float]:
    """Angles [degrees] by channel of a hand at an amount 0…1 of a control."""
    return {f"{side}.{channel}": share * degrees for channel, degrees in COARSE[name].items()}


def coarse_share(name: str, angles: Mapping[str, float], side: str) -> float | None:
    """Amount of a control that fits a pose best; None if the hand has none of its channels."""
    there = {f"{side}.{c}": degrees for c, degrees in COARSE[name].items() if f"{side}.{c}" in angles}
    weight = sum(degrees**2 for degrees in there.values())
    if not weight:
        return None
    return min(max(sum(angles[c] * degrees for c, degrees in there.items()) / weight, 0.0), 1.0)


def of_side(angles: Mapping[str, float], side: str) -> dict[str, float]:
    """Channels of one side, without the side's name; equal angles on the other side give the mirrored pose."""
    return {name.partition(".")[2]: value for name, value in angles.items() if name.startswith(f"{side}.")}


def on_side(angles: Mapping[str, float], side: str) -> dict[str, float]:
    """Inverse of ``of_side``: channels with the side's name."""
    return {f"{side}.{name}": value for name, value in angles.items()}


def mixed(here: Mapping[str, float], there: Mapping[str, float], share: float) -> dict[str, float]:
    """Linear interpolation between two poses; ``share`` 0 is ``here``, 1 is ``there``."""
    return {name: value + share * (there.get(name, value) - value) for name, value in here.items()}
