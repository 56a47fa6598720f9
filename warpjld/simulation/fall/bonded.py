"""Groups of objects that bonds hold together (R101, R102)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from warpjld.geometry.coincident import connected_parts
from warpjld.simulation.specification import BondStrength

__all__ = ["bonded_groups"]


def bonded_groups(names: Iterable[str], bonds: Sequence[BondStrength]) -> list[list[str]]:
    """Names that bonds connect, in order; those without a bond alone. Bonds to other names are left out."""
    number = {name: k for k, name in enumerate(names)}
    pairs = [(number[b.one], number[b.other]) for b in bonds if b.one in number and b.other in number]
    groups: dict[int, list[str]] = {}
    for name, label in zip(number, connected_parts(np.array(pairs, np.int64).reshape(-1, 2), len(number)), strict=True):
        groups.setdefault(int(label), []).append(name)
    return list(groups.values())
