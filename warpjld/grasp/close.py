"""Closing a hand: its digits bend until their skin touches the object (A §7, R76; R90)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.grasp.both_ways import BothWays, give_way
from warpjld.grasp.closing import ClosingHands
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.found import Status
from warpjld.grasp.objects import Places
from warpjld.grasp.separate import keep_apart
from warpjld.skeleton import Poses

__all__ = ["Closed", "close_hand"]

_ROUNDS = 4  # of bending and opening again
_TOUCH = 1e-4  # skin this near touches [m]
_PRESSED = 5e-4  # depth of an object's edges in the skin that stays [m]
_THROUGH = 1e-3  # the same of a digit on its way [m]
_QUICK = 3  # every third vertex searches at a first look


@dataclass(frozen=True, eq=False)
class Closed:
    """Hands closed from G postures.

    Attributes:
        angles: Joint angles [rad], shape (G, J, 4).
        digits: Names of the digits that closed, e.g. ``left.index``.
        status: Per digit and joint how its search ended (values of ``Status``), shape (G, D, 3); CONVERGED is a touch,
            NO_CONTACT the limit reached without one.
        gap: Smallest signed distance of every digit's skin and the object [m], looked at from both sides (see
            ``BothWays``), after a first look from the skin's only; shape (G, D).
        penetration: Depth of digits, or of the palm, and object in one another [m], likewise, shape (G,).
    """

    angles: NDArray[np.float64]
    digits: tuple[str, ...]
    status: NDArray[np.int32]
    gap: NDArray[np.float64]
    penetration: NDArray[np.float64]

    def touching(self) -> NDArray[np.bool_]:
        """Digits within a tenth of a millimetre of the object, shape (G, D)."""
        return np.asarray(self.gap < _TOUCH)


def close_hand(
    covering: Covering,
    poses: Poses,
    angles: NDArray[np.float64],
    objects: ObjectSet,
    *,
    which: NDArray[np.int32] | int = 0,
    places: Places | None = None,
    digits: Sequence[str] = (),
    coupling: tuple[float, float] | None = None,
    apart: bool = True,
    quick: bool = False,
    tolerance: float = 1e-5,
    threads: int | None = None,
) -> Closed:
    """Close the digits of G hands, each on its object, in a few launches.

    Every digit bends at its base until a vertex beyond touches, then at its second joint, then at its third; a joint
    whose skin touches already stays. With ``coupling`` all three bend together until the first touch, the others at
    these times the base's rate; joints beyond the touch then go on together. Skin that swells as a finger bends may
    enter the object beside a touch: the base then opens as far as it must, and the joints beyond close again. What of
    the object, an edge or a corner, then is deeper than half a millimetre in the skin between its vertices, opens the
    digit it is in (``give_way``).

    Args:
        covering: The hand, smooth method.
        poses: G postures to start from, open.
        angles: Their joint angles [rad], shape (G, J, 4).
        objects: Search structures.
        which: Object of every hand.
        places: Place of every hand's object; the objects' own if left out.
        digits: Names of digits; all if left out.
        coupling: Rates of the second and third joint relative to the base.
        apart: Stop digits that would pass through one another or the palm; the costliest part.
        quick: For a first look at many hands: a third of the vertices search, and nothing opens again; ``apart`` is
            left out.
        tolerance: Distance that counts as a touch [m].
        threads: CPU threads.

    Raises:
        InputError: No such digit, or postures of another skeleton.
    """
    chains = digit_chains(covering.skeleton, digits)
    count = len(poses)
    which = np.broadcast_to(objects.check(which), count)
    if places is None:
        places = objects.places(which)
    elif len(places) == 1:
        places = places[np.zeros(count, dtype=int)]
    hands = ClosingHands(
        covering,
        poses,
        angles,
        objects,
        which,
        places,
        every=_QUICK if quick else 1,
        tolerance=tolerance,
        threads=threads,
    )
    joints = np.array(list(chains.values()))
    if coupling is not None:
        hands.bend(joints, np.array([1.0, *coupling]))
    status = _bend_in_turn(hands, joints, rounds=1 if quick else _ROUNDS)
    names = tuple(chains)
    if quick:
        gap, depth = hands.skin_gaps(joints[:, 0].tolist())
        return Closed(hands.angles, names, status, gap, depth)
    both = [BothWays(covering, thing) for thing in objects.objects]

    def gaps(g: int, wanted: NDArray[np.float64], moved: bool = True) -> NDArray[np.float64]:
        skin = covering.deform(hands.poses_of(g, wanted[None]), threads=threads)[0]
        return both[which[g]].gaps(skin, places[g], moved=moved)

    gap, depth = np.empty((count, len(names))), np.empty(count)
    for g in range(count):
        parts = both[which[g]].parts
        hands.angles[g], _ = give_way(
            partial(gaps, g), parts, angles[g], hands.angles[g], chains, allowed=_PRESSED, on_the_way=_THROUGH
        )
        if apart:
            hands.angles[g], stopped = keep_apart(
                covering, partial(hands.poses_of, g), angles[g], hands.angles[g], chains
            )
            status[g, [names.index(name) for name in stopped]] = int(Status.BLOCKED)
        now = gaps(g, hands.angles[g], moved=False)
        gap[g] = now[[parts.index(name) for name in names]]
        depth[g] = max(0.0, -float(now.min()))
    return Closed(hands.angles, names, status, gap, depth)


def _bend_in_turn(hands: ClosingHands, joints: NDArray[np.int64], rounds: int) -> NDArray[np.int32]:
    """Bend the joints of all digits (D, 3) one after another, opening in between what swelled into the object.

    Returns:
        How the joints' searches ended, shape (G, D, 3).
    """
    status = np.full((len(hands), *joints.shape), int(Status.NO_CONTACT), dtype=np.int32)
    going = np.ones(len(hands), dtype=bool)
    for again in range(rounds):
        before = hands.angles.copy()
        for k in range(1 if again else 0, 3):
            # a joint with a touch at or beyond its segment finds it at once and stays
            ended = hands.bend(joints[:, k:], np.array([1.0, 0.0, 0.0])[: 3 - k])
            # skin left inside by less than twice the tolerance is a touch
            ended = np.where(ended == int(Status.INSIDE), int(Status.CONVERGED), ended) if again else ended
            status[going, :, k] = ended[going]
        # what has settled stays, or a hand would end otherwise beside others than alone
        hands.angles[~going] = before[~going]
        if rounds == 1:
            break
        going &= hands.settle(joints[:, 0].tolist())
        if not going.any():
            break
    return status
