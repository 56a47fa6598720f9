"""BVH evaluated frame by frame with 4 by 4 matrices, apart from what the package does: an oracle for its writer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def axis_turn(axis: str, degrees: float) -> NDArray[np.float64]:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    out = np.eye(4)
    a, b = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
    out[a, a], out[b, b], out[a, b], out[b, a] = c, c, -s, s
    return out


def evaluate(path: Path) -> tuple[list[str], list[int], NDArray[np.float64], NDArray[np.float64], float]:
    """Names, parents, channel values (F, C), world transforms (F, B, 4, 4), frame time; end sites are left out."""
    words = path.read_text("utf-8").split()
    assert words[0] == "HIERARCHY"
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: list[list[str]] = []
    stack: list[int] = []
    at = 1
    while words[at] != "MOTION":
        word = words[at]
        if word in ("ROOT", "JOINT"):
            parents.append(stack[-1] if stack else -1)
            names.append(words[at + 1])
            assert words[at + 2] == "{"
            stack.append(len(names) - 1)
            at += 3
        elif word == "OFFSET":
            if len(offsets) < len(names):
                offsets.append([float(x) for x in words[at + 1 : at + 4]])
            at += 4
        elif word == "CHANNELS":
            count = int(words[at + 1])
            channels.append(words[at + 2 : at + 2 + count])
            at += 2 + count
        elif word == "End":
            assert words[at + 1 : at + 4] == ["Site", "{", "OFFSET"]
            assert words[at + 7] == "}"
            at += 8
        else:
            assert word == "}", word
            stack.pop()
            at += 1
    assert not stack
    assert words[at + 1] == "Frames:"
    frames = int(words[at + 2])
    assert words[at + 3 : at + 5] == ["Frame", "Time:"]
    values = np.array(words[at + 6 :], dtype=np.float64).reshape(frames, sum(map(len, channels)))
    worlds = np.empty((frames, len(names), 4, 4))
    for frame in range(frames):
        row = iter(values[frame])
        for joint, (parent, offset, own) in enumerate(zip(parents, offsets, channels, strict=True)):
            local = np.eye(4)
            local[:3, 3] = offset
            turn = np.eye(4)
            for channel in own:
                value = next(row)
                if channel.endswith("position"):
                    local["XYZ".index(channel[0]), 3] = value
                else:
                    turn = turn @ axis_turn(channel[0], value)
            worlds[frame, joint] = (worlds[frame, parent] if parent >= 0 else np.eye(4)) @ local @ turn
    return names, parents, values, worlds, float(words[at + 5])
