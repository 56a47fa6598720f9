"""Texts of SHOW and HELP."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields

import numpy as np

from warpjld.script.keys import joint_numbers
from warpjld.script.registry import Command
from warpjld.script.scene import Actor, Scene
from warpjld.skeleton import CHANNELS

__all__ = ["actors", "command_listing", "joints", "parameter_listing", "values"]


def values(actor: Actor, frame: float, rate: float) -> str:
    """Keyed joint angles, placement and joint positions of an actor at any frame (R4)."""
    from warpjld.script.staging import stage

    lines = [f"{actor.name} at frame {frame:g}"]
    for channel, track in actor.motion.tracks.items():
        at = "key" if frame in track.frames else "in-between"
        lines.append(f"  {channel:<36} {np.degrees(track.spline(frame)):>9.3f}°  {at}")
    for channel, track in actor.placement.tracks.items():
        moved = channel.startswith("move")
        value = float(track.spline(frame))
        lines.append(f"  {channel:<36} {value if moved else np.degrees(value):>9.3f}{' m' if moved else '°'}")
    if len(lines) == 1:
        lines.append("  driven by a motion file" if actor.recorded else "  no keys: the rest pose")
    positions = stage(actor, np.array([frame]), rate).positions[0]
    lines.append("  joint positions [m]")
    lines += [
        f"  {name:<36} {x:>9.4f} {y:>9.4f} {z:>9.4f}"
        for name, (x, y, z) in zip(actor.skeleton.names, positions, strict=True)
    ]
    return "\n".join(lines)


def actors(scene: Scene) -> str:
    """One line per actor; the current one is marked by a star."""
    lines = []
    for actor in scene.actors.values():
        star = "*" if actor.name == scene.current else " "
        span = "no keys" if actor.span is None else "frames {:g} to {:g}".format(*actor.span)
        lines.append(
            f"{star} {actor.name:<12} {actor.rig.name}: {len(actor.skeleton)} joints, "
            f"{len(actor.rig.surface.vertices)} vertices, {span}, {actor.method} covering"
        )
    return "\n".join(lines) or "there is no actor yet"


def joints(actor: Actor) -> str:
    """An actor's joints with their numbers for JOINT, limits of movable channels and nonzero rest angles [degrees]."""
    lines = []
    numbers = {joint: str(number) for number, joint in joint_numbers(actor.skeleton).items()}
    for joint, name in enumerate(actor.skeleton.names):
        limits = np.degrees(actor.skeleton.limits[joint])
        open_ = [f"{c} {low:.4g}…{high:.4g}" for c, (low, high) in zip(CHANNELS, limits, strict=True) if low < high]
        initial = np.degrees(actor.skeleton.initial[joint])
        rest = ", ".join(f"{c} {angle:.4g}" for c, angle in zip(CHANNELS, initial, strict=True) if angle)
        at_rest = f"; at rest {rest}" if rest else ""
        lines.append(f"{numbers.get(joint, ''):>4}  {name:<36} {', '.join(open_) or 'fixed'}{at_rest}")
    return "\n".join(lines)


def parameter_listing(actor: Actor) -> str:
    """An actor's parameters, one line per joint."""
    names = [field.name for field in fields(actor.parameters)]
    lines = [f"{'':<36} " + " ".join(f"{name:>12}" for name in names)]
    for joint, name in enumerate(actor.skeleton.names):
        cells = []
        for field in names:
            value = np.atleast_1d(getattr(actor.parameters, field)[joint])
            cells.append(f"{' '.join(f'{v:.3g}' for v in value):>12}")
        lines.append(f"{name:<36} {' '.join(cells)}")
    return "\n".join(lines)


def command_listing(chosen: Iterable[Command]) -> str:
    """One line per command."""
    listed = sorted(chosen, key=lambda c: c.name)
    return "\n".join(f"{c.name:<12} {c.help}" for c in listed) + (
        "\nMACRO        Makes a command of the lines up to END: MACRO <name> <parameter> …"
        "\nHELP <command> shows how one is written."
    )
