"""Loading of a grasp study's hands and objects, cached per process."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.covering.device import checked_device
from warpjld.covering.kept import bind_kept
from warpjld.errors import InputError
from warpjld.grasp import GraspObject
from warpjld.grasp.close import Closer
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.palm import Palm, palm_of
from warpjld.grasp.postures import posture_angles
from warpjld.grasp.segments import vertex_segments
from warpjld.grasp.subdivided_skin import FinerSkin
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, Skeleton, poses_from_angles
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.plan import Posture

__all__ = ["Hand", "Opened", "Thing", "closer_of", "device_identity", "hand_of", "opened_hand", "thing_of"]

_SPACING = 1.5e-3  # spacing of the sample points on the skin [m]


@dataclass(frozen=True, eq=False)
class Hand:
    """A hand ready for trials.

    Attributes:
        rig: The rig.
        covering: Its covering.
        side: ``left`` or ``right``.
        palm: Frame of the palm, on the skin.
        finer: Its skin with sample points 1.5 mm apart, for contacts.
        parts: Index into ``SEGMENTS`` of every sample point, shape (n,); -1 for points of no hand.
    """

    rig: Rig
    covering: Covering
    side: Literal["left", "right"]
    palm: Palm
    finer: FinerSkin
    parts: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Opened:
    """An open hand before it closes.

    Attributes:
        angles: Joint angles [rad], shape (J, 4).
        skin: Its skin with the root at rest [m], shape (V, 3).
    """

    angles: NDArray[np.float64]
    skin: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Thing:
    """An object ready for trials, at its scale.

    Attributes:
        body: The object.
        mass: Its mass [kg].
        radius: Largest distance of its surface from its centre of mass [m].
        device: Warp device of its search structures.
    """

    body: GraspObject
    mass: float
    radius: float
    device: str = "cpu"

    @cached_property
    def near(self) -> NearObject:
        """Its search structures, for all hands."""
        return NearObject(self.body, self.device)


def device_identity(device: str) -> dict[str, str]:
    """Part of an experiment's identity that depends on the device: empty for the CPU, else the device's name.

    Raises:
        InputError: There is no such device.
    """
    found = checked_device(device)
    return {} if found.is_cpu else {"device": str(found.name)}


@lru_cache(maxsize=4)
def hand_of(choice: HandChoice) -> Hand:
    """Build or read a hand and bind it; cached for the process.

    Raises:
        InputError: It cannot be used, or is not one hand.
    """
    rig = choice.load()
    sides: list[Literal["left", "right"]] = ["left", "right"]
    sides = [side for side in sides if f"{side}.middle.base" in rig.skeleton.names]
    if len(sides) != 1:
        raise InputError(f"hand {choice.name}: want a rig of one hand, this one has {len(sides)}", path=rig.path)
    covering, _ = bind_kept(rig)
    finer = FinerSkin(rig.surface.vertices, rig.surface.faces, _SPACING)
    parts = vertex_segments(covering)[finer.parents]
    return Hand(rig, covering, sides[0], palm_of(rig.skeleton).on_skin(rig.surface.vertices), finer, parts)


@lru_cache(maxsize=32)
def opened_hand(choice: HandChoice, posture: Posture) -> Opened:
    """A hand in its open posture; cached for the process.

    Raises:
        InputError: A posture beyond the joints' limits.
    """
    hand = hand_of(choice)
    skeleton = hand.rig.skeleton
    if isinstance(posture, str):
        angles = posture_angles(skeleton, hand.side, posture)
    else:
        angles = _angles(skeleton, posture, choice.name)
    skin = hand.covering.deform(poses_from_angles(skeleton, angles[None]), threads=1)[0]
    return Opened(angles, skin.astype(np.float64))


def _angles(skeleton: Skeleton, posture: tuple[tuple[str, str, float], ...], name: str) -> NDArray[np.float64]:
    angles = skeleton.initial.copy()
    for joint, channel, degrees in posture:
        j, k = skeleton.index(joint), CHANNELS.index(channel)
        low, high = np.degrees(skeleton.limits[j, k])
        if not low - 1e-6 <= degrees <= high + 1e-6:
            raise InputError(
                f"hand {name}: posture {joint} {channel} is {degrees:g}°; its limits are {low:.0f}° to {high:.0f}°"
            )
        angles[j, k] = np.radians(degrees)
    return angles


@lru_cache(maxsize=32)
def thing_of(choice: ObjectChoice, scale: float, density: float, device: str = "cpu") -> Thing:
    """Build or read an object at a scale, with search structures on a device; cached for the process.

    Raises:
        InputError: It cannot be used, or has neither volume nor mass.
    """
    body = choice.load(scale)
    # a given mass is for scale 1; at other scales it is proportional to the volume
    mass = density * abs(body.volume) if choice.mass is None else choice.mass * scale**3
    if not mass > 0.0:
        raise InputError(f"object {choice.name}: encloses no volume; give it a mass")
    radius = float(np.linalg.norm(body.vertices - body.centroid, axis=1).max())
    return Thing(body, mass, radius, device)


@lru_cache(maxsize=32)
def closer_of(choice: HandChoice, wanted: ObjectChoice, scale: float, density: float, device: str = "cpu") -> Closer:
    """``Closer`` of a hand on an object, on a device; cached for the process.

    Raises:
        InputError: Hand or object cannot be used.
    """
    thing = thing_of(wanted, scale, density, device)
    return Closer(hand_of(choice).covering, thing.body, thing.near)
