"""Assembly of hands detected independently per frame into one track per hand, with gaps interpolated."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.motion.gaps import bridged
from warpjld.motion.hand_motion import HandRecording
from warpjld.motion.hand_track import HandTrack

__all__ = ["SeenHand", "recording_of"]

_SURE = 0.5
"""Confidence, 0 to 1, below which a landmark or hand counts as lost; MediaPipe's default."""
_FEW = 0.2
"""Largest share of frames in which a single hand's less frequent label counts as a detection error."""


@dataclass(frozen=True, eq=False, slots=True)
class SeenHand:
    """A hand detected in one frame.

    Attributes:
        points: Its L landmarks, shape (L, 3).
        sure: Confidence in each landmark, 0 to 1, shape (L,).
        side: ``left`` or ``right``, or None without a label.
        score: Confidence in the hand.
        slot: Its index among the hands of its frame.
    """

    points: NDArray[np.float64]
    sure: NDArray[np.float64]
    side: str | None
    score: float
    slot: int


def recording_of(
    seen: Sequence[Sequence[SeenHand]],
    joints: Sequence[str],
    times: NDArray[np.float64],
    rate: float,
    notes: list[str],
) -> HandRecording:
    """Tracks of the detected hands, identified by their labels, or by their order if they have none.

    A hand is lost in frames with a confidence below one half, or where at most half of its landmarks reach that; single
    landmarks below it are interpolated over time.

    Args:
        seen: The hands of every frame.
        joints: Joint names of the landmarks, without side.
        times: Times of the frames [s].
        rate: Frames a second.
        notes: The reader's notes so far.

    Raises:
        InputError: No hand at all, a landmark that is never visible, or labels of some hands only.
    """
    kept = [[one for one in hands if one.score >= _SURE and (one.sure >= _SURE).mean() > 0.5] for hands in seen]
    if not any(kept):
        raise InputError("no frame holds a hand that was seen with a confidence of 0.5 or more")
    notes = list(notes)
    kept = _one_label(kept, notes)
    rows: dict[str | int, dict[int, SeenHand]] = {}
    doubled = 0
    for number, hands in enumerate(kept):
        for one in sorted(hands, key=lambda hand: -hand.score):
            row = rows.setdefault(one.slot if one.side is None else one.side, {})
            doubled += number in row
            row.setdefault(number, one)
    if doubled:
        notes.append(f"{doubled} hands with the label of another in their frame were left out")
    if len({isinstance(key, str) for key in rows}) > 1:
        raise InputError("some hands have a handedness, others have none: state it for all, or for none")
    tracks = []
    for key, row in rows.items():
        side = key if isinstance(key, str) else None
        what = f"the {side} hand" if side else "the hand" if len(rows) == 1 else f"hand {key}"
        frames = list(row)
        notes += bridged(what, frames)
        if (frames[0], frames[-1]) != (0, len(seen) - 1):
            notes.append(f"{what} is seen from frame {frames[0]} to {frames[-1]} of {len(seen)}: held before and after")
            row = {0: row[frames[0]]} | row | {len(seen) - 1: row[frames[-1]]}
            frames = list(row)
        points = np.array([one.points for one in row.values()])
        unsure = np.empty(points.shape[:2], dtype=bool)
        for number, one in enumerate(row.values()):
            unsure[number] = one.sure < _SURE
        for landmark in np.flatnonzero(unsure.any(axis=0)).tolist():
            good = ~unsure[:, landmark]
            if not good.any():
                raise InputError(f"'{joints[landmark]}' is never seen with a confidence of 0.5 or more")
            for axis in range(3):
                column = points[:, landmark, axis]
                points[:, landmark, axis] = np.interp(times[frames], times[frames][good], column[good])
        if unsure.any():
            notes.append(f"{what}: {np.count_nonzero(unsure)} unsure landmarks were interpolated")
        tracks.append(
            HandTrack(
                side,
                times[frames],
                {joint: points[:, k] for k, joint in enumerate(joints)},
                may_be_mirrored=True,
                labels=tuple(f"frame {number}" for number in frames),
            )
        )
    return HandRecording(tuple(tracks), rate, tuple(notes))


def _one_label(seen: list[list[SeenHand]], notes: list[str]) -> list[list[SeenHand]]:
    """Correct occasional wrong labels of a hand that is always alone."""
    labels = Counter(one.side for hands in seen for one in hands if one.side is not None)
    if len(labels) < 2 or max(len(hands) for hands in seen) > 1:
        return seen
    (most, _), (_, fewer) = labels.most_common()
    if fewer > _FEW * sum(labels.values()):
        return seen
    notes.append(f"a hand that is always alone is called {most}, but in {fewer} frames the other: read as {most}")
    return [[replace(one, side=most) for one in hands] for hands in seen]
