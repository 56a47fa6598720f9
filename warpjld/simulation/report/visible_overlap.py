"""Remaining overlap of visible surfaces after contact, and displacement of skin without simulated flesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from warpjld.simulation.bodies.flesh_body import FLESHED
from warpjld.simulation.display.overlap import Overlap, SurfacePart
from warpjld.simulation.display.surfaces import DeformedSurfaces

__all__ = ["RemainingOverlap", "remaining_overlaps", "visible_overlap_notes"]

_SEEN = 2e-4
"""Overlap from which a note is given [m]."""


@dataclass(frozen=True)
class RemainingOverlap:
    """Two surfaces that overlap at solved frames although contact should separate them.

    Attributes:
        one, other: Objects or parts of a hand.
        depth: Largest depth after the display correction [m].
        first, last: First and last frame at which they overlap.
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


def remaining_overlaps(surfaces: DeformedSurfaces) -> list[RemainingOverlap]:
    """Overlaps that contact should have removed, deepest first; forces there are wrong."""
    found: dict[tuple[SurfacePart, SurfacePart], RemainingOverlap] = {}
    for frame in (solved.frame for solved in surfaces.frames):
        for one, other, overlap in _solved_overlaps(surfaces, frame):
            if overlap.depth > surfaces.most(one.surface):
                two = (other, one) if (other, one) in found else (one, other)
                was = found.get(two, RemainingOverlap(*two, 0.0, frame, frame))
                found[two] = RemainingOverlap(*two, max(was.depth, overlap.depth), was.first, frame)
    return sorted(found.values(), key=lambda one: -one.depth)


def visible_overlap_notes(surfaces: DeformedSurfaces, frame: float) -> list[str]:
    """Notes on a frame: overlap that remains visible, and skin without simulated flesh that was displaced."""
    carried, separated = surfaces.carried(frame), surfaces.separated(frame)
    out = []
    for (one, other), depth in separated.left.items():
        if depth > _SEEN:
            text = f"{one.text} and {other.text} are seen to overlap by {1e3 * depth:.1f} mm at frame {frame:g}"
            out.append(f"{text}: {_why(surfaces, one, other)}")
    for hand in surfaces.model.hands:
        bare = hand.shape.blend < FLESHED
        away = separated.vertices[hand.name][bare] - carried[hand.name].vertices[bare]
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


def _solved_overlaps(surfaces: DeformedSurfaces, frame: float) -> Iterator[tuple[SurfacePart, SurfacePart, Overlap]]:
    """Overlaps of surfaces that contact solves, with hands divided into parts."""
    hands = {hand.name: hand for hand in surfaces.model.hands}
    for (one, other), overlap in surfaces.overlaps(frame, surfaces.most).items():
        hand = hands.get(one.surface)
        if hand is None:
            yield one, other, overlap
            continue
        fleshed = overlap.of(hand.fleshed)
        if not one.part:
            for part in hand.parts.name_of(fleshed.vertices):
                yield SurfacePart(one.surface, part), other, fleshed.of(hand.parts.mask(part))
        elif hand.touches_itself and hand.has_flesh(other.part):
            yield one, other, fleshed


def _why(surfaces: DeformedSurfaces, one: SurfacePart, other: SurfacePart) -> str:
    """Advice for removing the overlap of two surfaces."""
    for hand in surfaces.model.hands:
        if one.surface == hand.name and one.part and other.part:
            bare = [part for part in (one.part, other.part) if not hand.has_flesh(part)]
            if bare:
                return f"FLESH {hand.name} … {' '.join(bare).upper()} makes them press on each other"
            if not hand.touches_itself:
                return f"FLESH {hand.name} … ITSELF ON makes them press on each other"
    return "smaller elements follow their shapes better"
