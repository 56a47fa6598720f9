"""Diversity of a study's grasps, by hand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.quality import diversity
from warpjld.study.grasping.choices import HandChoice
from warpjld.study.grasping.load import hand_of

__all__ = ["varieties"]


def varieties(
    hands: Iterable[HandChoice], rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]
) -> dict[str, Any]:
    """`warpjld.grasp.quality.diversity` of every hand's grasps (``all``) and of its ``successes``, by hand's name.

    Args:
        hands: The study's hands.
        rows: The table.
        arrays: Arrays as in ``poses.npz``.
    """
    return {hand.name: _of_hand(hand, rows, arrays) for hand in hands if f"{hand.name}/angles" in arrays}


def _of_hand(hand: HandChoice, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    limits = hand_of(hand).rig.skeleton.limits
    free = limits[..., 1] > limits[..., 0]
    angles = arrays[f"{hand.name}/angles"][:, free]
    own = [rows[trial] for trial in arrays[f"{hand.name}/angles.trials"].tolist()]
    ways = np.array([[row[f"wrist_{axis}"] for axis in "xyz"] for row in own], dtype=np.float64)
    good = np.array([row["success"] is True for row in own])
    out = {}
    for name, chosen in (("all", np.ones(len(own), dtype=bool)), ("successes", good)):
        chosen = chosen & (np.linalg.norm(ways, axis=1) > 1e-9)
        if chosen.any():
            out[name] = asdict(diversity(angles[chosen], limits[free], ways[chosen]))
    return out
