"""Paths of falling objects, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from warpjld.grasp import Places

__all__ = ["FallPath", "fall_summaries"]

_MOVED = 2e-4
"""Displacement from which a fall is reported [m]; less is the settling of an object at rest."""


@dataclass(eq=False)
class FallPath:
    """Path of a free object.

    Attributes:
        name: Name of the object.
        frames: Frame numbers, ascending.
        places: Placements at these frames.
        rests: Frame from which on it rests; None: it still moves at the last frame.
        on: Names of what it rests on.
        left: Frame at which it is below everything it could fall on; None if it never is.
        held: Frame at which hands hold it; None if they never do.
        speed: Speed at the last frame [m/s].
        together: Names of all objects that bonds hold together at its begin.
        inside: Name of what it begins inside of; empty if nothing.
        depth: How deep it begins inside of that [m].
    """

    name: str
    frames: list[float]
    places: list[Places]
    rests: float | None = None
    on: tuple[str, ...] = ()
    left: float | None = None
    held: float | None = None
    speed: float = 0.0
    together: tuple[str, ...] = ()
    inside: str = ""
    depth: float = 0.0

    def at(self, frame: float) -> Places:
        """Placement at a frame, interpolated; constant before the first and after the last frame."""
        k = int(np.clip(np.searchsorted(self.frames, frame + 1e-9) - 1, 0, len(self.frames) - 1))
        if k + 1 == len(self.frames) or frame <= self.frames[k]:
            return self.places[k]
        part = (frame - self.frames[k]) / (self.frames[k + 1] - self.frames[k])
        one, two = self.places[k], self.places[k + 1]
        turn = two.rotation * (np.sign(float(one.rotation[0] @ two.rotation[0])) or 1.0)
        return Places.of((1.0 - part) * one.position + part * two.position, (1.0 - part) * one.rotation + part * turn)

    @property
    def distance(self) -> float:
        """Largest distance from its first position [m]."""
        first = self.places[0].position
        return max(float(np.linalg.norm(place.position - first)) for place in self.places)

    @property
    def fate(self) -> tuple[object, ...]:
        """What is said of it: where it ends, and when."""
        return (
            self.together or self.name,
            self.frames[0],
            self.left,
            self.held,
            self.rests,
            self.on,
            round(self.speed, 3),
            self.inside,
            round(self.depth, 4),
        )

    def summary(self, others: Iterable[str] = ()) -> str:
        """``BALL … falls from frame 0 on, and comes to rest on BOWL at frame 61``; empty if it did not fall.

        ``others`` are names of objects of the same fate.
        """
        if self.distance < _MOVED and self.rests is not None:
            return ""
        names = [self.name, *others]
        one = len(names) == 1
        be, it, fall, come, leave, move, begin = (
            ("is", "it", "falls", "comes", "leaves", "moves", "begins")
            if one
            else ("are", "they", "fall", "come", "leave", "move", "begin")
        )
        listed = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        begun = f"{listed} {be} held by nothing: {it} {fall} from frame {self.frames[0]:g} on"
        if self.inside:
            begun = (
                f"{listed} {begin} {1e3 * self.depth:.2g} mm inside {self.inside} at frame {self.frames[0]:g}, "
                f"{be} held by nothing, and {be} pushed out"
            )
        if self.left is not None:
            below = "it" if one else "them"
            return f"{begun}, and {leave} the stage at frame {self.left:g}: nothing is below {below}"
        if self.held is not None:
            return f"{begun}, until {it} {be} held at frame {self.held:g}"
        if self.rests is not None:
            return f"{begun}, and {come} to rest on {' and '.join(self.on)} at frame {self.rests:g}"
        return f"{begun}, and still {move} at frame {self.frames[-1]:g} at {self.speed:.2g} m/s: see FRAMES"


def fall_summaries(paths: Iterable[FallPath]) -> list[str]:
    """What is said of falls; bonded objects of the same fate are named together."""
    groups: dict[tuple[object, ...], list[FallPath]] = {}
    for path in paths:
        groups.setdefault(path.fate, []).append(path)
    texts = (first.summary(path.name for path in others) for first, *others in groups.values())
    return [text for text in texts if text]
