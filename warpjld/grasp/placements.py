"""Placements of an open hand around an object: palm first, or thumb and fingers across a part that fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.opening import Opening
from warpjld.grasp.palm import palm_of
from warpjld.grasp.widths import Widths
from warpjld.skeleton import Poses, Skeleton, poses_from_angles

__all__ = ["Candidates", "across_widths", "around", "sample_wrists"]

_CLEARANCE = 3e-4  # between the open hand and the object [m]
_SPARE = 0.02  # by which a hand opens wider than what it takes [m]
_STEPS = 32
_NEXT = 1e-5  # a step shorter than this is none [m]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Placements of G open hands.

    Attributes:
        position: Displacement of the skeleton's root [m], shape (G, 3).
        rotation: Rotation of the root about its rest place, x y z w, shape (G, 4).
        approach: Direction in which the hand came, shape (G, 3).
        angles: Joint angles [rad], shape (G, J, 4).
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    approach: NDArray[np.float64]
    angles: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, rows: NDArray | slice) -> Candidates:
        return Candidates(self.position[rows], self.rotation[rows], self.approach[rows], self.angles[rows])

    def poses(self, skeleton: Skeleton, angles: NDArray[np.float64] | None = None) -> Poses:
        """The hands, open or with other angles (G, J, 4)."""
        return poses_from_angles(
            skeleton,
            self.angles if angles is None else angles,
            root_position=self.position,
            root_rotation=self.rotation,
        )

    def moved(self, by: NDArray[np.float64]) -> Candidates:
        """The same farther along their approach by lengths [m], shape (G,)."""
        return Candidates(self.position + self.approach * by[:, None], self.rotation, self.approach, self.angles)

    @staticmethod
    def joined(some: list[Candidates]) -> Candidates:
        """One after another."""
        names = ("position", "rotation", "approach", "angles")
        return Candidates(*(np.concatenate([getattr(one, name) for one in some]) for name in names))


def sample_wrists(
    covering: Covering,
    angles: NDArray[np.float64],
    near: NearObject,
    side: str,
    count: int,
    rng: np.random.Generator,
    *,
    ahead: float = 0.0,
) -> Candidates:
    """Placements of an open hand with its palm on the object.

    The palm looks against a direction out of the object's centre, evenly spread over the sphere; the fingers point
    anywhere about it; the palm's middle is aimed at the centre, off by up to a fifth of the object's size. The hand
    then comes as near as it can without touching: its skin's distance bounds each step. With ``ahead`` [m] the object
    is met up to that far before the palm's middle towards the fingers, and the palm stays as far away from it.
    """
    palm, thing = palm_of(covering.skeleton, side), near.thing
    part = rng.uniform(0.0, 1.0, size=(count, 1)) if ahead else np.zeros((count, 1))
    middle = palm.middle + ahead * part * palm.fingers
    golden = np.pi * (3.0 - 5.0**0.5)
    k = np.arange(count) + 0.5
    high = 1.0 - 2.0 * k / count
    out = np.stack([np.sqrt(1 - high**2) * np.cos(golden * k), high, np.sqrt(1 - high**2) * np.sin(golden * k)], axis=1)
    look = -(Rotation.random(rng=rng).apply(out))
    fingers = around(look, rng)
    rotation = Rotation.from_matrix(palm.turned_to(look, fingers))
    centre = thing.place.apply(thing.centroid[None])[0, 0]
    aim = centre + rng.uniform(-0.2, 0.2, size=(count, 3)) * thing.size
    root = covering.skeleton.rest[0]
    there = Candidates(
        aim - (root + rotation.apply(middle - root)),
        rotation.as_quat(),
        look,
        np.repeat(angles[None], count, axis=0),
    )
    back = np.full(count, float(np.linalg.norm(thing.size)) + 0.1)
    beside = _come(covering, there.moved(-back), near, 2.0 * back)
    return beside.moved(-ahead * part[:, 0])


def across_widths(
    covering: Covering,
    openings: list[Opening],
    near: NearObject,
    widths: Widths,
    ways: NDArray[np.float64],
    side: str,
    rng: np.random.Generator,
    *,
    into: float = 1.0,
) -> Candidates:
    """Placements with the thumb at one end of a width and the fingers at the other, one for each width.

    The hand opens so far that the width fits with 2 cm to spare and comes at right angles to it. At first the pads are
    to meet the ends: a precision grip. From there it goes on for a random part of the way on which the palm would reach
    the width, as far as it does not touch: towards a power grip.

    Args:
        covering: The hand.
        openings: Postures; every width takes one of them.
        near: The object.
        widths: N of them.
        ways: Directions in which the hands come, at right angles to the widths, shape (N, 3).
        side: Which hand.
        rng: Source of randomness.
        into: Largest part of the way to the palm.
    """
    count, skeleton = len(widths), covering.skeleton
    middle = palm_of(skeleton, side).middle
    chosen = rng.integers(len(openings), size=count)
    rows = [openings[k] for k in chosen]
    fit = [one.step_for(width) for one, width in zip(rows, widths.width, strict=True)]
    loose = [one.step_for(width + _SPARE) for one, width in zip(rows, widths.width, strict=True)]
    thumb = np.stack([one.thumb[k] for one, k in zip(rows, fit, strict=True)])
    fingers = np.stack([one.fingers[k] for one, k in zip(rows, fit, strict=True)])
    between = 0.5 * (thumb + fingers)
    own = _frame(fingers - thumb, between - middle)
    line = unit(widths.second - widths.first)
    wanted = _frame(line, ways)
    rotation = Rotation.from_matrix(np.einsum("gki,gkj->gij", wanted, own))
    root = skeleton.rest[0]
    position = 0.5 * (widths.first + widths.second) - (root + rotation.apply(between - root))
    angles = np.stack([one.angles[k] for one, k in zip(rows, loose, strict=True)])
    there = Candidates(position, rotation.as_quat(), wanted[:, 1], angles)
    deeper = ((between - middle) * own[:, 1]).sum(axis=1) * rng.uniform(0.0, into, size=count)
    back = np.full(count, float(np.linalg.norm(near.thing.size)) + 0.15)
    return _come(covering, there.moved(-back), near, back + deeper)


def _come(covering: Covering, hands: Candidates, near: NearObject, reach: NDArray[np.float64]) -> Candidates:
    """Move hands along their approach, as far as ``reach`` (G,) or until their skin is next to the object."""
    skin = covering.deform(hands.poses(covering.skeleton), threads=1)
    moved, going = np.zeros(len(hands)), np.arange(len(hands))
    for _ in range(_STEPS):
        shift = (hands.approach[going] * moved[going, None])[:, None].astype(np.float32)
        gap = near.least(skin[going] + shift)
        # a hand that has come too near goes back by as much
        ahead = np.minimum(gap - _CLEARANCE, reach[going] - moved[going])
        moved[going] += np.where(ahead > 0.0, ahead, 1.05 * ahead - 1e-5)
        going = going[(np.abs(ahead) >= _NEXT) & (moved[going] < reach[going])]
        if not len(going):
            break
    return hands.moved(moved)


def around(axis: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Unit vectors normal to others (G, 3), the angle about them even."""
    aside = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)]))
    roll = rng.uniform(0.0, 2.0 * np.pi, size=(len(axis), 1))
    return np.asarray(np.cos(roll) * aside + np.sin(roll) * np.cross(axis, aside))


def _frame(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Right-handed frames as rows: along the first vectors, along the second as far as square to them, (G, 3, 3)."""
    x = unit(first)
    y = unit(second - x * (x * second).sum(axis=1, keepdims=True))
    return np.stack([x, y, np.cross(x, y)], axis=1)
