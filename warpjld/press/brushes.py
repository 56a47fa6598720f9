"""Touches that come and go between two frames, so that neither of them shows a force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warpjld.fem.contact import ContactInstant
from warpjld.press.bodies import Bodies

__all__ = ["Brush", "brushes_between"]

_LEAST = 1e-6
"""Force that counts as a touch [N]."""


@dataclass(frozen=True)
class Brush:
    """One digit and what it brushes.

    Attributes:
        actor: Whose.
        digit: Or the palm.
        against: What it touches.
        before, after: The frames between which it does, and at which it does not.
        force: Highest force that presses [N].
    """

    actor: str
    digit: str
    against: str
    before: float
    after: float
    force: float

    @property
    def text(self) -> str:
        """``LEFT index touches PLATE between frames 3 and 4, with up to 0.4 N, and at neither of them: …``."""
        return (
            f"{self.actor} {self.digit} touches {self.against} between frames {self.before:g} and {self.after:g}, with "
            f"up to {self.force:.2g} N, and at neither of them: no table shows it; move more slowly, or use more frames"
        )


def brushes_between(
    bodies: Bodies, before: ContactInstant | None, instants: Sequence[ContactInstant], start: float
) -> list[Brush]:
    """What touches between two frames and at neither.

    Args:
        bodies: Everything.
        before: At the frame before; None where nothing was solved yet.
        instants: After it; the last of them at the frame itself.
        start: Frame of time 0.
    """
    known = set() if before is None else set(_touching(bodies, before))
    known |= set(_touching(bodies, instants[-1]))
    most: dict[tuple[str, str, str], float] = {}
    for instant in instants[:-1]:
        for place, force in _touching(bodies, instant).items():
            if place not in known:
                most[place] = max(force, most.get(place, 0.0))
    since = start if before is None else start + before.time
    return [Brush(*place, since, start + instants[-1].time, force) for place, force in most.items()]


def _touching(bodies: Bodies, instant: ContactInstant) -> dict[tuple[str, str, str], float]:
    """Force [N] by actor, digit, and what it touches."""
    out: dict[tuple[str, str, str], float] = {}
    for owner, touch in zip(bodies.owners, instant.touches, strict=False):
        for hand in bodies.hands:
            if hand.name not in (owner.slave, owner.master) or not touch.nodal_contact.force.any():
                continue
            force = touch.nodal_contact.force[bodies.spans[hand.name]]
            label = hand.part.hand.node_labels
            skin = np.flatnonzero((label >= 0) & (force > 0.0))
            digit = hand.parts.part_of[label[skin]]
            total = np.bincount(digit, force[skin], len(hand.parts.names))
            other = owner.master if owner.slave == hand.name else owner.slave
            for number in np.flatnonzero(total > _LEAST):
                place = (hand.name, hand.parts.names[number], other)
                out[place] = out.get(place, 0.0) + float(total[number])
    return out
