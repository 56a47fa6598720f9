"""Hands of a study's trials: open and placed, closed, and posed with the skin that is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.quality import ContactPatches
from warpjld.grasp.touching import touching_patches
from warpjld.skeleton import poses_from_angles
from warpjld.study.grasping.load import Hand, Thing

__all__ = ["OpenHand", "PosedHand", "TouchingSkin", "TriedHand", "posed_hands", "touching_skins"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OpenHand:
    """A placed open hand: angles (J, 4), displacement and rotation of its root, values by column."""

    angles: Array
    position: Array
    rotation: Array
    values: dict[str, Any]


@dataclass(frozen=True, eq=False)
class TriedHand:
    """A closed hand: open and closed angles (J, 4), placement of its root, whether it touches, values by column."""

    start: Array
    angles: Array
    position: Array
    rotation: Array
    touches: bool
    values: dict[str, Any]


@dataclass(frozen=True, eq=False)
class TouchingSkin:
    """A skin on an object, in the object's frame.

    Attributes:
        skin: The deformed skin [m], shape (V, 3).
        patches: Where it touches the object.
        deepest: Depth of the deepest of its sample points in the object [m].
    """

    skin: NDArray[np.float32]
    patches: ContactPatches
    deepest: float


@dataclass(frozen=True, eq=False)
class PosedHand:
    """A closed hand as it is measured: its wrist joint [m], shape (3,), and its skin."""

    wrist: Array
    touching: TouchingSkin


def touching_skins(hand: Hand, thing: Thing, skins: NDArray[np.float32], contact: float) -> list[TouchingSkin]:
    """Contacts of deformed skins (G, V, 3) in the object's frame [m], with the distance that counts as contact [m]."""
    found = touching_patches(hand.finer, hand.parts, thing.near, skins, contact)
    return [TouchingSkin(skin, patches, float(depth)) for skin, patches, depth in zip(skins, *found, strict=True)]


def posed_hands(
    hand: Hand, thing: Thing, tried: Sequence[TriedHand], contact: float, *, device: str = "cpu"
) -> list[PosedHand]:
    """Pose closed hands on one object in a batch; each is bit for bit as if it were alone.

    Args:
        hand: The hand.
        thing: The object.
        tried: The closed hands.
        contact: Largest distance that counts as contact [m].
        device: Warp device of the covering.
    """
    if not tried:
        return []
    skeleton = hand.rig.skeleton
    poses = poses_from_angles(
        skeleton,
        np.stack([one.angles for one in tried]),
        root_position=np.stack([one.position for one in tried]),
        root_rotation=np.stack([one.rotation for one in tried]),
    )
    skins = hand.covering.deform(poses, device=device, threads=1)
    wrists = poses.positions[:, skeleton.index("wrist")]
    return [PosedHand(*one) for one in zip(wrists, touching_skins(hand, thing, skins, contact), strict=True)]
