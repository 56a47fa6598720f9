"""Contacts that begin and end between two frames, so that neither frame shows a force."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact import ContactInstant
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["MissedContact", "missed_contacts"]

_LEAST = 1e-6
"""Force from which on digit and object count as touching [N]."""


@dataclass(frozen=True)
class MissedContact:
    """Contact of one digit that neither of two successive frames shows.

    Attributes:
        actor: Name of the actor.
        digit: Digit, or ``palm``.
        against: Name of what it touches.
        before, after: Frames between which it touches, and at which it does not.
        force: Largest normal force [N].
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


def missed_contacts(
    model: ContactModel, before: SolvedFrame | None, instants: Sequence[ContactInstant]
) -> list[MissedContact]:
    """Contacts between two frames that neither of them shows.

    Args:
        model: The contact model.
        before: The previous frame; None if there is none.
        instants: Load steps after it; the last of them at the frame itself.
    """
    known = set() if before is None else set(_touching(model, before.nodal_contact.force))
    known |= set(_touching(model, _forces(instants[-1])))
    most: dict[tuple[str, str, str], float] = {}
    for instant in instants[:-1]:
        for place, force in _touching(model, _forces(instant)).items():
            if place not in known:
                most[place] = max(force, most.get(place, 0.0))
    since = model.start if before is None else before.frame
    until = model.start + instants[-1].time
    return [MissedContact(*place, since, until, force) for place, force in most.items()]


def _forces(instant: ContactInstant) -> list[Array]:
    """Normal contact forces of each pair on all nodes [N], each of shape (N,)."""
    return [touch.nodal_contact.force for touch in instant.touches]


def _touching(model: ContactModel, pressing: Iterable[Array]) -> dict[tuple[str, str, str], float]:
    """Force [N] by actor, digit and what it touches, given normal forces of each pair on all nodes [N], shape (N,)."""
    out: dict[tuple[str, str, str], float] = {}
    for owner, nodal in zip(model.owners, pressing, strict=False):
        for hand in model.hands:
            other = owner.other(hand.name)
            if other is None or not nodal.any():
                continue
            force = nodal[model.spans[hand.name]]
            label = hand.hand.node_labels
            skin = np.flatnonzero((label >= 0) & (force > 0.0))
            digit = hand.parts.part_of[label[skin]]
            total = np.bincount(digit, force[skin], len(hand.parts.names))
            for number in np.flatnonzero(total > _LEAST):
                place = (hand.name, hand.parts.names[number], other)
                out[place] = out.get(place, 0.0) + float(total[number])
    return out
