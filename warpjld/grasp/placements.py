"""Placements of an open hand at an object: palm first, or thumb and fingers across a part that fits between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.covering.device import shared_on
from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.opening import Opening
from warpjld.grasp.palm import palm_of
from warpjld.grasp.widths import Widths
from warpjld.skeleton import Poses, Skeleton, poses_from_angles

__all__ = ["Candidates", "across_widths", "around", "palms_on", "sample_wrists"]

_CLEARANCE = 3e-4  # distance at which the approach of the open hand stops [m]
_SPARE = 0.02  # by how much the hand opens wider than the part it takes [m]
_STEPS = 32  # largest number of steps of an approach
_NEXT = 1e-5  # the approach ends when a step gets shorter than this [m]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Placements of G open hands.

    Attributes:
        position: Displacement of the skeleton's root [m], shape (G, 3).
        rotation: Rotation of the root about its rest place, x y z w, shape (G, 4).
        approach: Unit direction in which the hand moves to its placement, shape (G, 3).
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
        """Poses of the hands, with their open angles or with others (G, J, 4) [rad]."""
        return poses_from_angles(
            skeleton,
            self.angles if angles is None else angles,
            root_position=self.position,
            root_rotation=self.rotation,
        )

    def moved(self, by: NDArray[np.float64]) -> Candidates:
        """Copy moved forward along the approach by lengths (G,) [m]."""
        return Candidates(self.position + self.approach * by[:, None], self.rotation, self.approach, self.angles)

    @staticmethod
    def joined(batches: list[Candidates]) -> Candidates:
        """Concatenation of several batches."""
        names = ("position", "rotation", "approach", "angles")
        return Candidates(*(np.concatenate([getattr(batch, name) for batch in batches]) for name in names))


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

    The palms face the object's centre from directions distributed evenly over the sphere, with a random roll of the
    fingers; the palm's centre is aimed at the object's centre, displaced by up to a fifth of the object's size. The
    hand then approaches until its skin is next to the object; the skin's distance bounds each step.

    Args:
        covering: The hand.
        angles: Joint angles of the open hand [rad], shape (J, 4).
        near: The object.
        side: ``left`` or ``right``.
        count: Number of placements.
        rng: Source of random numbers.
        ahead: Largest distance in front of the palm's centre, towards the fingers, at which the object is met, and
            that the palm stays away from it [m]; drawn at random for every placement.
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
    beside = _approach(covering, there.moved(-back), near, 2.0 * back)
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

    The hand opens 2 cm wider than the width and approaches at right angles to it. A placement at which the pads meet
    the ends would be a precision grip; from there the hand moves on by a random fraction of the distance to the palm,
    as far as it does not touch, towards a power grip.

    Args:
        covering: The hand.
        openings: Closing motions; one is chosen at random for every width.
        near: The object.
        widths: N widths of the object.
        ways: Directions of approach, at right angles to the widths, shape (N, 3).
        side: ``left`` or ``right``.
        rng: Source of random numbers.
        into: Largest fraction of the distance from the pads to the palm that the hand moves on.
    """
    count, skeleton = len(widths), covering.skeleton
    middle = palm_of(skeleton, side).middle
    chosen = rng.integers(len(openings), size=count)
    rows = [openings[k] for k in chosen]
    fit = [opening.step_for(width) for opening, width in zip(rows, widths.width, strict=True)]
    loose = [opening.step_for(width + _SPARE) for opening, width in zip(rows, widths.width, strict=True)]
    thumb = np.stack([opening.thumb[k] for opening, k in zip(rows, fit, strict=True)])
    fingers = np.stack([opening.fingers[k] for opening, k in zip(rows, fit, strict=True)])
    between = 0.5 * (thumb + fingers)
    own = _frame(fingers - thumb, between - middle)
    line = unit(widths.second - widths.first)
    wanted = _frame(line, ways)
    rotation = Rotation.from_matrix(np.einsum("gki,gkj->gij", wanted, own))
    root = skeleton.rest[0]
    position = 0.5 * (widths.first + widths.second) - (root + rotation.apply(between - root))
    angles = np.stack([opening.angles[k] for opening, k in zip(rows, loose, strict=True)])
    there = Candidates(position, rotation.as_quat(), wanted[:, 1], angles)
    deeper = ((between - middle) * own[:, 1]).sum(axis=1) * rng.uniform(0.0, into, size=count)
    back = np.full(count, float(np.linalg.norm(near.thing.size)) + 0.15)
    return _approach(covering, there.moved(-back), near, back + deeper)


def palms_on(
    covering: Covering,
    angles: NDArray[np.float64],
    near: NearObject,
    side: str,
    aim: NDArray[np.float64],
    look: NDArray[np.float64],
    fingers: NDArray[np.float64],
) -> Candidates:
    """Placements of an open hand with its palm's centre aimed at points, moved up to the object.

    Args:
        covering: The hand.
        angles: Joint angles of the open hand [rad], shape (J, 4).
        near: The object.
        side: ``left`` or ``right``.
        aim: World points [m], shape (G, 3).
        look: Unit directions of the palm normals, which are the directions of approach, shape (G, 3).
        fingers: Unit directions of the fingers, perpendicular to those, shape (G, 3).
    """
    palm, count = palm_of(covering.skeleton, side), len(aim)
    rotation = Rotation.from_matrix(palm.turned_to(look, fingers))
    root = covering.skeleton.rest[0]
    position = aim - (root + rotation.apply(palm.middle - root))
    there = Candidates(position, rotation.as_quat(), look, np.repeat(angles[None], count, axis=0))
    back = np.full(count, float(np.linalg.norm(near.thing.size)) + 0.1)
    return _approach(covering, there.moved(-back), near, 2.0 * back)


def _approach(covering: Covering, hands: Candidates, near: NearObject, reach: NDArray[np.float64]) -> Candidates:
    """Move hands forward by up to ``reach`` (G,) [m], or until their skin is within ``_CLEARANCE`` of the object."""
    import warp as wp
    from warpjld_kernels.lines_to_object import come_near

    skins = covering.deform(hands.poses(covering.skeleton), threads=1)
    place = near.thing.place
    scratch = np.empty((2, *skins.shape[:2]), dtype=np.float32)
    arrays: list[tuple[NDArray, Any]] = [
        (skins, wp.vec3),
        (np.ascontiguousarray(hands.approach), wp.vec3d),
        (reach.astype(np.float64), wp.float64),
    ]
    settings = [_CLEARANCE, _NEXT, _STEPS]
    rest: list[tuple[NDArray, Any]] = [(scratch[0], float), (scratch[1], float), (np.zeros(len(hands)), wp.float64)]
    held, out = ([shared_on(near.device, a, kind) for a, kind in group] for group in (arrays, rest))
    objects = [near.objects.solids, near.grid, wp.vec3d(*place.position[0]), wp.quatd(*place.rotation[0])]
    wp.launch(come_near, len(hands), inputs=[*objects, *held, *settings, *out], device=near.device)
    return hands.moved(out[-1].numpy())


def around(axis: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Random unit vectors perpendicular to axes (G, 3), uniform in the angle about each, shape (G, 3)."""
    aside = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)]))
    roll = rng.uniform(0.0, 2.0 * np.pi, size=(len(axis), 1))
    return np.asarray(np.cos(roll) * aside + np.sin(roll) * np.cross(axis, aside))


def _frame(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Right-handed orthonormal frames by Gram–Schmidt, as rows, shape (G, 3, 3)."""
    x = unit(first)
    y = unit(second - x * (x * second).sum(axis=1, keepdims=True))
    return np.stack([x, y, np.cross(x, y)], axis=1)
