"""Closing of hands on an object: digits flex until their skin touches it, many hands in one batch (A §7, R76; R90)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.closing import ClosingHands, MovedSkin
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.give_way import give_way
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.keep_apart import keep_apart
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.posed_skins import PosedSkins
from warpjld.grasp.search_result import SearchStatus
from warpjld.skeleton import Poses

__all__ = ["Closed", "Closer"]

_ROUNDS = 4  # largest number of rounds of flexing and opening again
_TOUCH = 1e-4  # largest gap that counts as a touch [m]
_PRESSED = 5e-4  # depth of the object's edges in the skin that is tolerated at the end [m]
_THROUGH = 1e-3  # depth above which a digit counts as passing through the object on its way [m]
_QUICK = 3  # every third vertex is searched when closing roughly


@dataclass(frozen=True, eq=False)
class Closed:
    """Result of ``Closer.close`` for G hands.

    Attributes:
        angles: Joint angles [rad], shape (G, J, 4).
        digits: Names of the digits that closed, e.g. ``left.index``.
        status: Per digit and joint how its search ended (values of ``SearchStatus``), shape (G, D, 3); CONVERGED is a
            touch, NO_CONTACT the limit reached without one.
        gap: Smallest signed distance between every digit's skin and the object [m], measured both ways (see
            ``HandObjectGaps``), after ``quick`` only from the skin's vertices; shape (G, D).
        penetration: Largest penetration depth of digits or palm and object [m], measured likewise, shape (G,).
    """

    angles: NDArray[np.float64]
    digits: tuple[str, ...]
    status: NDArray[np.int32]
    gap: NDArray[np.float64]
    penetration: NDArray[np.float64]

    def __getitem__(self, hands: slice) -> Closed:
        return Closed(self.angles[hands], self.digits, self.status[hands], self.gap[hands], self.penetration[hands])

    def touching(self) -> NDArray[np.bool_]:
        """Mask of the digits within 0.1 mm of the object, shape (G, D)."""
        return np.asarray(self.gap < _TOUCH)


class Closer:
    """Closes one hand on one object, many postures at a time; keeps the search structures of both.

    Args:
        covering: The hand, smooth method.
        thing: The object.
        near: Search structures of the object, if there are some already, such as those of another hand's ``Closer``.
        device: Warp device of new ones, on which joints flex until the first touch and distances to the object are
            measured. Distances to the skin, and between digits, are measured on the CPU.

    Attributes:
        both: Distances between this hand and object.
    """

    def __init__(
        self, covering: Covering, thing: GraspObject, near: NearObject | None = None, device: str = "cpu"
    ) -> None:
        self.covering, self.thing, self.both = covering, thing, HandObjectGaps(covering, thing, near, device)
        self._skin, self._posed = kept_with(covering, MovedSkin), kept_with(covering, PosedSkins)

    def close(
        self,
        poses: Poses,
        angles: NDArray[np.float64],
        *,
        places: Places | None = None,
        digits: Sequence[str] = (),
        coupling: tuple[float, float] | None = None,
        apart: bool = True,
        quick: bool = False,
        tolerance: float = 1e-5,
    ) -> Closed:
        """Close the digits of G hands. The result of a hand is bit for bit the same in any batch.

        Every digit flexes at its base until a vertex at or beyond that joint touches, then at its second joint, then at
        its third; a joint whose skin touches already stays. With ``coupling`` all three flex together until the first
        touch, the second and third at these rates relative to the base; then each joint flexes in turn as above. Skin
        that swells as a finger flexes may enter the object beside a touch: the base then opens as far as necessary, and
        the joints beyond it close again. Finally, a digit is opened while an edge or corner of the object is deeper
        than 0.5 mm in its skin, which the skin's vertices alone do not detect (``give_way``).

        Args:
            poses: G open postures to start from.
            angles: Their joint angles [rad], shape (G, J, 4).
            places: Placement of the object for every hand, or one for all; the object's own if left out.
            digits: Names of digits; all if left out.
            coupling: Rates of the second and third joint relative to the base.
            apart: Stop digits that would pass through one another or the palm.
            quick: Close roughly, to rank many hands: only every third vertex is searched, nothing opens again, and
                ``apart`` is ignored.
            tolerance: Distance that counts as a touch [m].

        Raises:
            InputError: No such digit, or postures of another skeleton.
        """
        chains = digit_chains(self.covering.skeleton, digits)
        where = self._places(places, len(poses))
        hands = self._hands(poses, angles, where, every=_QUICK if quick else 1, tolerance=tolerance)
        joints = np.array(list(chains.values()))
        if coupling is not None:
            hands.bend(np.arange(len(hands)), joints, np.array([1.0, *coupling]))
        status = _bend_in_turn(hands, joints, rounds=1 if quick else _ROUNDS)
        if quick:
            return Closed(hands.angles, tuple(chains), status, *hands.skin_gaps(joints[:, 0].tolist()))

        def depths(rows: NDArray[np.int64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
            return self.both.depths(hands.skins_of(rows, wanted), where[rows], moved=True)

        way = {"allowed": _PRESSED, "on_the_way": _THROUGH}
        given, _ = give_way(depths, self.both.parts, angles, hands.angles, chains, **way)
        if apart:
            return self._parted(hands, angles, given, status, chains, where)
        return self._closed(hands, given, status, chains, where)

    def parted(
        self, poses: Poses, angles: NDArray[np.float64], closed: Closed, *, places: Places | None = None
    ) -> Closed:
        """Separate digits of hands that were closed without ``apart``; the result is as if closed with it.

        Args:
            poses: The open hands, as given to ``close``; likewise ``angles`` and ``places``.
            closed: What ``close`` returned for them.
        """
        return self._parted_at(poses, angles, closed.angles, closed.digits, closed.status.copy(), places)

    def parted_at(
        self, poses: Poses, angles: NDArray[np.float64], wanted: NDArray[np.float64], digits: tuple[str, ...]
    ) -> Closed:
        """As ``parted``, of hands that close from ``angles`` to ``wanted`` [rad], each (G, J, 4), without a search."""
        status = np.full((len(poses), len(digits), 3), int(SearchStatus.CONVERGED), dtype=np.int32)
        return self._parted_at(poses, angles, wanted, digits, status, None)

    def _parted_at(
        self,
        poses: Poses,
        angles: NDArray[np.float64],
        wanted: NDArray[np.float64],
        digits: tuple[str, ...],
        status: NDArray[np.int32],
        places: Places | None,
    ) -> Closed:
        where = self._places(places, len(poses))
        hands = self._hands(poses, angles, where, every=1, tolerance=0.0)
        return self._parted(hands, angles, wanted, status, digit_chains(self.covering.skeleton, digits), where)

    def _places(self, places: Places | None, count: int) -> Places:
        where = self.thing.place if places is None else places
        return where[np.zeros(count, dtype=int)] if len(where) == 1 else where

    def _hands(
        self, poses: Poses, angles: NDArray[np.float64], places: Places, *, every: int, tolerance: float
    ) -> ClosingHands:
        return ClosingHands(self._skin, poses, angles, self.both.near, places, every=every, tolerance=tolerance)

    def _parted(
        self,
        hands: ClosingHands,
        start: NDArray[np.float64],
        given: NDArray[np.float64],
        status: NDArray[np.int32],
        chains: dict[str, tuple[int, ...]],
        places: Places,
    ) -> Closed:
        angles, gone = keep_apart(self._posed, hands.skins_of, start, given, chains)
        status[gone < 1.0] = int(SearchStatus.BLOCKED)
        return self._closed(hands, angles, status, chains, places)

    def _closed(
        self,
        hands: ClosingHands,
        angles: NDArray[np.float64],
        status: NDArray[np.int32],
        chains: dict[str, tuple[int, ...]],
        places: Places,
    ) -> Closed:
        gaps = self.both.gaps(hands.skins_of(np.arange(len(hands)), angles), places)
        of_digits = gaps[:, [self.both.parts.index(name) for name in chains]]
        return Closed(angles, tuple(chains), status, of_digits, np.maximum(0.0, -gaps.min(axis=1)))


def _bend_in_turn(hands: ClosingHands, joints: NDArray[np.int64], rounds: int) -> NDArray[np.int32]:
    """Flex the joints of all digits (D, 3) one after another, and open those whose skin swelled into the object.

    Returns:
        ``SearchStatus`` of the joints' searches, shape (G, D, 3).
    """
    status = np.full((len(hands), *joints.shape), int(SearchStatus.NO_CONTACT), dtype=np.int32)
    going = np.arange(len(hands))
    for again in range(rounds):
        for k in range(1 if again else 0, 3):
            # a joint with a touch at or beyond its segment finds it at once and stays
            ended = hands.bend(going, joints[:, k:], np.array([1.0, 0.0, 0.0])[: 3 - k])
            # skin that ``settle`` leaves inside, by less than twice the tolerance, counts as a touch
            ended = np.where(ended == int(SearchStatus.INSIDE), int(SearchStatus.CONVERGED), ended) if again else ended
            status[going, :, k] = ended
        if rounds == 1:
            break
        going = going[hands.settle(going, joints[:, 0].tolist())]
        if not len(going):
            break
    return status
