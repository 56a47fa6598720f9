"""Operators of a skeleton: one segment each for fingers and limbs, several side by side in the palm (R16, R19)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.skull import CROWN
from warpjld.skeleton.tree import Segment, Skeleton

__all__ = ["Fan", "fans", "segment_ends"]


@dataclass(frozen=True)
class Fan:
    """Segments of one operator, side by side, each a neighbour of the next.

    A finger or limb is a fan of one segment. The palm's metacarpals are a fan of five, and so are the bones of the
    carpus behind them; inside a fan virtual segments join neighbours (A §4, Fig. 5).

    Attributes:
        name: Name in reports, e.g. ``left.index.knuckle2`` (the joint where it begins) or ``left.palm``.
        segments: Segments from ulnar to radial.
        muscle: Whether internal muscles inflate; they do not in the palm (R50).
        stiff: Whether its whole domain turns rigidly with the bone, without rounding, as a skull does.
    """

    name: str
    segments: tuple[Segment, ...]
    muscle: bool
    stiff: bool = False


def fans(skeleton: Skeleton) -> tuple[Fan, ...]:
    """All operators of a skeleton; segments without length are left out."""
    shortest = 1e-6 * float(np.linalg.norm(np.ptp(skeleton.rest, axis=0)))
    by_distal = {s.distal: s for s in skeleton.segments if _length(skeleton, s) > shortest}
    groups: list[Fan] = []
    used: set[int] = set()
    for palm in skeleton.palms:
        side = skeleton.names[palm[0][0]].rpartition(".")[0].rpartition(".")[0]
        carpus = [proximal for proximal, _ in palm]
        for label, distals in (("palm", [distal for _, distal in palm]), ("carpus", carpus)):
            side_by_side = tuple(by_distal[d] for d in distals if d in by_distal)
            if side_by_side:
                groups.append(Fan(f"{side}.{label}".lstrip("."), side_by_side, muscle=False))
            used.update(distals)
    for d, s in by_distal.items():
        if d not in used:
            stiff = skeleton.names[d] == CROWN
            groups.append(Fan(skeleton.names[s.proximal], (s,), muscle=not stiff, stiff=stiff))
    return tuple(groups)


def segment_ends(groups: tuple[Fan, ...]) -> NDArray[np.int32]:
    """Proximal and distal joint of every segment of the fans in order, shape (S, 2)."""
    return np.array([(s.proximal, s.distal) for fan in groups for s in fan.segments], dtype=np.int32)


def _length(skeleton: Skeleton, segment: Segment) -> float:
    return float(np.linalg.norm(skeleton.rest[segment.distal] - skeleton.rest[segment.proximal]))
