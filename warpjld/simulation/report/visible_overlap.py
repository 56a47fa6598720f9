"""What surfaces show that no force knows of: overlap that stays, and skin pushed aside that has no flesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.simulation.bodies.flesh_body import WORN, HandBody
from warpjld.simulation.display.overlap import Over, SurfacePart
from warpjld.simulation.display.surfaces import Pressed

__all__ = ["Missed", "missed", "seen"]

_SEEN = 2e-4
"""Overlap that is worth a note [m]."""


@dataclass(frozen=True)
class Missed:
    """Two that overlap, at frames that were solved, by more than contact leaves.

    Attributes:
        one, other: Objects, or parts of a hand with its name.
        depth: At most, beyond what pictures move apart [m].
        first, last: Frames.
    """

    one: SurfacePart
    other: SurfacePart
    depth: float
    first: float
    last: float

    @property
    def text(self) -> str:
        """``LEFT index and BALL overlap by 4.2 mm at frames 12 to 20``."""
        when = f"frame {self.first:g}" if self.first == self.last else f"frames {self.first:g} to {self.last:g}"
        return f"{self.one.text} and {self.other.text} overlap by {1e3 * self.depth:.1f} mm at {when}"


def missed(pressed: Pressed) -> list[Missed]:
    """What contact was to keep apart and did not, deepest first: forces there are wrong."""
    found: dict[tuple[SurfacePart, SurfacePart], Missed] = {}
    for frame in (solved.frame for solved in pressed.solved.frames):
        for one, other, over in _known(pressed, frame):
            if over.depth > pressed.most(one.surface):
                two = (other, one) if (other, one) in found else (one, other)
                was = found.get(two, Missed(*two, 0.0, frame, frame))
                found[two] = Missed(*two, max(was.depth, over.depth), was.first, frame)
    return sorted(found.values(), key=lambda one: -one.depth)


def seen(pressed: Pressed, frame: float) -> list[str]:
    """Notes on a frame: overlap that its pictures show, and what pushes skin aside that has no flesh to give way."""
    shown = pressed.shown(frame)
    cleared = pressed.cleared(frame)
    out = []
    for two, depth in cleared.left.items():
        if depth > _SEEN:
            text = f"{two[0].text} and {two[1].text} are seen to overlap by {1e3 * depth:.1f} mm at frame {frame:g}"
            out.append(f"{text}: {_why(pressed, *two)}")
    for hand in pressed.bodies.hands:
        bare = hand.part.blend < WORN
        away = cleared.vertices[hand.name][bare] - shown[hand.name].vertices[bare]
        far = np.linalg.norm(away, axis=1)
        deepest = float(far.max(initial=0.0))
        if deepest > _SEEN:
            where = hand.parts.name_of(np.flatnonzero(bare)[far > _SEEN])
            out.append(
                f"{hand.name}: skin of the {' and '.join(where)} that has no flesh is pushed aside by up to "
                f"{1e3 * deepest:.1f} mm at frame {frame:g}, and no force is counted there; FLESH {hand.name} … "
                f"{' '.join(where).upper()} gives it flesh"
            )
    return out


def _known(pressed: Pressed, frame: float) -> Iterator[tuple[SurfacePart, SurfacePart, Over]]:
    """Overlap that is contact's concern, of parts of hands by their names."""
    hands = {hand.name: hand for hand in pressed.bodies.hands}
    for (one, other), over in pressed.cleared(frame).inside.items():
        hand = hands.get(one.surface)
        if hand is None:
            yield one, other, over
            continue
        fleshed = over.of(hand.part.blend > WORN)
        if not one.part:
            for part in hand.parts.name_of(fleshed.vertices):
                yield SurfacePart(one.surface, part), other, fleshed.of(_mask(hand, part))
        elif hand.itself and hand.worn(other.part):
            yield one, other, fleshed


def _mask(hand: HandBody, part: str) -> NDArray[np.bool_]:
    return np.asarray(hand.parts.part_of[hand.parts.labels] == hand.parts.names.index(part))


def _why(pressed: Pressed, one: SurfacePart, other: SurfacePart) -> str:
    """What leaves two overlapping, and what to do."""
    for hand in pressed.bodies.hands:
        parts = [one.part, other.part]
        if one.surface == hand.name and all(parts):
            bare = [part for part in parts if not hand.worn(part)]
            if bare:
                return f"FLESH {hand.name} … {' '.join(bare).upper()} makes them press on each other"
            if not hand.itself:
                return f"FLESH {hand.name} … ITSELF ON makes them press on each other"
    return "smaller elements follow their shapes better"
