"""Warnings about recorded motions: implausible jumps, and movements that the rig does not follow."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import conjugate, multiply, rotate
from warpjld.motion.clip import Clip
from warpjld.skeleton.recognise.names import read_name

__all__ = ["doubts_of_clip", "doubts_of_own_joints", "jumps"]

_JUMP = 90.0
"""Smallest rotation [°] between samples that counts as a jump: 2700° a second at 30 samples a second."""

_MOVES = 5.0
"""Smallest rotation [°] relative to the parent at which a joint counts as moved."""

_SHIFTS = 0.01
"""Smallest translation relative to the parent, per size of the figure, at which a joint counts as moved."""

_SHOWN = 4  # joints named in one message


def jumps(clip: Clip) -> list[str]:
    """Warnings about joints that turn by more than 90° against their parent from one frame to the next, each with the
    largest jump and its frame."""
    if len(clip) < 2:
        return []
    widest = np.max([steps.max(axis=0) for steps in _steps(clip)], axis=0)
    found = [int(j) for j in np.argsort(-np.round(widest, 1), kind="stable") if widest[j] > _JUMP]
    shown = found[:_SHOWN]
    at = _first_steps(clip, shown, widest[shown] - 0.05)
    lines = [
        f"{clip.names[j]} turns by {widest[j]:.0f}° from frame {frame} to {frame + 1} of the recording: a flip?"
        for j, frame in zip(shown, at, strict=True)
    ]
    if len(found) > _SHOWN:
        others = [clip.names[j] for j in found[_SHOWN:]]
        lines.append(f"so do {_listed(others)}, by more than {_JUMP:.0f}° from one frame to the next")
    return lines


def _steps(clip: Clip) -> Iterator[NDArray[np.float64]]:
    """Rotations of all joints, relative to their parents, between consecutive frames [degrees], in blocks."""
    last = clip[:0].locals()
    for block in clip.blocks():
        turns = np.concatenate([last, block.locals()])
        last = turns[-1:]
        if len(turns) > 1:
            yield _degrees_between(turns[:-1], turns[1:])


def _first_steps(clip: Clip, joints: list[int], least: NDArray[np.float64]) -> list[int]:
    """First frame of each given joint from which its rotation to the next frame is the given one."""
    out = [-1] * len(joints)
    start = 0
    for steps in _steps(clip) if joints else ():
        wide = steps[:, joints] >= least
        for k in np.flatnonzero(wide.any(axis=0)).tolist():
            out[k] = start + int(wide[:, k].argmax()) if out[k] < 0 else out[k]
        start += len(steps)
    return out


def doubts_of_clip(clip: Clip, used: Collection[int]) -> list[str]:
    """Warning, if any, about joints that a clip moves and that nothing in the rig follows.

    A single frame is compared with the rest pose, several with the first of them.

    Args:
        clip: The recording.
        used: Indices of its joints that drive a joint of the rig, or are ancestors of one that does.
    """
    first = clip[:1]
    size = float(np.linalg.norm(np.ptp(first.positions[0], axis=0)))
    if len(clip) == 1:
        at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (1, len(clip.names), 1))
        first = replace(first, positions=clip.rest[None], rotations=at_rest)
    turned, place = first.locals(), _in_parents(first)
    angles, shifts = np.zeros(len(clip.names)), np.zeros(len(clip.names))
    for block in clip.blocks():
        angles = np.maximum(angles, _degrees_between(turned, block.locals()).max(axis=0))
        shifts = np.maximum(shifts, np.linalg.norm(_in_parents(block) - place, axis=-1).max(axis=0))
    moved = [
        name
        for j, name in enumerate(clip.names)
        if j not in used
        and (angles[j] > _MOVES or (clip.parents[j] >= 0 and shifts[j] > _SHIFTS * size))
        and read_name(name).kind != "helper"
    ]
    return [f"the motion moves {_listed(moved)}, which nothing in the rig follows"] if moved else []


def _in_parents(clip: Clip) -> NDArray[np.float64]:
    """Positions of all joints in the axes of their parents' bones, shape (F, B, 3)."""
    above = np.maximum(clip.parents, 0)
    return rotate(conjugate(clip.rotations[:, above]), clip.positions - clip.positions[:, above])


def doubts_of_own_joints(clip: Clip, followed: Collection[str]) -> list[str]:
    """Warning, if any, about what an animation of the rig's own joints moves and the rig does not follow.

    Args:
        clip: The animation.
        followed: Names of its joints that are joints of the rig.
    """
    used: set[int] = set()
    for j, name in enumerate(clip.names):
        k = j if name in followed else -1
        while k >= 0 and k not in used:
            used.add(k)
            k = int(clip.parents[k])
    return doubts_of_clip(clip, used)


def _degrees_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    apart = multiply(conjugate(a), b)
    return np.asarray(2.0 * np.degrees(np.arctan2(np.linalg.norm(apart[..., :3], axis=-1), np.abs(apart[..., 3]))))


def _listed(names: Sequence[str]) -> str:
    """Names as a list, numbered ones as a range ``Thumb1…Thumb3``: the first few, then how many more."""
    runs: list[list[str]] = []
    for name in names:
        if runs and re.sub(r"\d", "", runs[-1][-1]) == re.sub(r"\d", "", name):
            runs[-1].append(name)
        else:
            runs.append([name])
    shown = [run[0] if len(run) == 1 else f"{run[0]}…{run[-1]}" for run in runs[:_SHOWN]]
    rest = sum(len(run) for run in runs[_SHOWN:])
    return ", ".join(shown) + (f" and {rest} more" if rest else "")
