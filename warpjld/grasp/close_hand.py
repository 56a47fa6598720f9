"""Closing of one hand on one object from a given open pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.close import Closer
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.search_result import SearchStatus
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

__all__ = ["ClosedHand", "close_hand"]


@dataclass(frozen=True, eq=False)
class ClosedHand:
    """Result of ``close_hand``.

    Attributes:
        poses: The closed hand, one frame.
        angles: Its joint angles [rad], shape (J, 4).
        gap: Smallest signed distance between each digit's skin and the object [m], by the digit's name.
        status: Status of the search of each of a digit's joints, base first, by the digit's name: CONVERGED: it
            touches; NO_CONTACT: it reached its limit without a touch; BLOCKED: another digit or the palm stopped it.
        touching: Names of the digits within 0.1 mm of the object.
        penetration: Largest penetration depth of digits or palm and object [m].
    """

    poses: Poses
    angles: NDArray[np.float64]
    gap: dict[str, float]
    status: dict[str, tuple[SearchStatus, ...]]
    touching: tuple[str, ...]
    penetration: float

    def __repr__(self) -> str:
        return (
            f"ClosedHand({len(self.touching)} of {len(self.gap)} digits touch, "
            f"penetration {1e3 * self.penetration:.2f} mm)"
        )


def close_hand(
    covering: Covering,
    thing: GraspObject,
    *,
    angles: ArrayLike | None = None,
    position: ArrayLike = (0.0, 0.0, 0.0),
    rotation: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    digits: Sequence[str] = (),
    coupling: tuple[float, float] | None = None,
    apart: bool = True,
) -> ClosedHand:
    """Close a hand on an object until its skin touches (A §7, R76).

    Args:
        covering: The hand, smooth method.
        thing: The object at its own placement.
        angles: Joint angles of the open hand [rad], shape (J, 4); the rest pose if left out.
        position: Displacement of the skeleton's root from rest [m], shape (3,).
        rotation: Rotation of the root about its rest place, unit quaternion x, y, z, w.
        digits: Digits that close, as ``left.index``; all if left out.
        coupling: Rates of the second and third joint relative to the base's, if the joints are to flex together; else
            they flex one after another.
        apart: Stop digits that would pass through one another or the palm.

    Raises:
        InputError: No such digit, or arrays of another shape.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> ball = wj.shapes.ball(0.065).placed((0.004, -0.0495, -0.062))
        >>> closed = wj.close_hand(wj.bind(hand), ball, digits=["left.index"])
        >>> closed.touching
        ('left.index',)
        >>> closed.penetration < 5e-4  # m
        True
    """
    skeleton = covering.skeleton
    shape = (len(skeleton), len(CHANNELS))
    start = np.zeros(shape) if angles is None else np.asarray(angles, dtype=np.float64)
    if start.shape != shape:
        raise InputError(f"angles: want shape {shape}, got {start.shape}")
    place, turn = np.asarray(position, dtype=np.float64), np.asarray(rotation, dtype=np.float64)
    if place.shape != (3,) or turn.shape != (4,):
        raise InputError(f"position, rotation: want shapes (3,) and (4,), got {place.shape} and {turn.shape}")

    def posed(hand: NDArray[np.float64]) -> Poses:
        return poses_from_angles(skeleton, hand, root_position=place[None], root_rotation=turn[None])

    closed = Closer(covering, thing).close(
        posed(start[None]), start[None], digits=digits, coupling=coupling, apart=apart
    )
    touching = closed.touching()[0]
    return ClosedHand(
        posed(closed.angles),
        closed.angles[0],
        dict(zip(closed.digits, closed.gap[0].tolist(), strict=True)),
        {
            name: tuple(SearchStatus(int(code)) for code in codes)
            for name, codes in zip(closed.digits, closed.status[0], strict=True)
        },
        tuple(name for name, touches in zip(closed.digits, touching, strict=True) if touches),
        float(closed.penetration[0]),
    )
