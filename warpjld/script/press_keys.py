"""What a contact solve writes into the animation: grips that were found, angles that were corrected (R120, R123)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from warpjld.script.scene import SplineConstants
from warpjld.skeleton import CHANNELS

if TYPE_CHECKING:
    from warpjld.simulation.grip.find import FoundGrip
    from warpjld.script.scene import Actor, Scene

__all__ = ["REST", "corrected_keys", "gripped_keys"]

REST = SplineConstants(tension=1.0)
"""A key at which a joint rests: what follows it does not change what leads to it."""

_THROUGH = SplineConstants()

_FLEXION = CHANNELS.index("flexion")


def gripped_keys(actor: Actor, found: FoundGrip) -> None:
    """Keys that held the angles from which on a search closed the digits hold those that it found."""
    wish = found.wish
    for channel in wish.channels:
        track = actor.motion.tracks[channel]
        was = next(key.value for key in track.keys if key.frame == wish.first)
        joint = actor.skeleton.index(channel.rpartition(".")[0])
        high = float(actor.skeleton.limits[joint, _FLEXION, 1])
        for key in track.keys:
            if key.frame > wish.first and key.value == was:
                track.set(replace(key, value=max(was, min(was + found.grip, high))))


def corrected_keys(
    scene: Scene, start: float, name: str, since: float, time: float, flexions: dict[int, float]
) -> None:
    """Keys of the angles that muscles can hold, at a frame; what came before it is kept by a key at every frame.

    Args:
        scene: The stage.
        start: Frame of time 0.
        name: Of the actor.
        since: Time of the frame before.
        time: Time of the frame.
        flexions: Joint → flexion there [rad].
    """
    actor = scene.actor(name)
    for joint, value in flexions.items():
        channel = f"{actor.skeleton.names[joint]}.flexion"
        first = min(key.frame for key in actor.motion.tracks[channel].keys)
        before = np.unique([*np.arange(np.ceil(first), start + since + 1e-9), start + since])
        kept = actor.motion.value(channel, before)
        for frame, was in zip(before.tolist(), kept.tolist(), strict=True):
            actor.set_keys(channel, [frame], was, _THROUGH)
        actor.set_keys(channel, [start + time], value, _THROUGH)
