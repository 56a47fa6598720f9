"""Groups of objects that bonds hold together (R101, R102)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from warpjld.simulation.specification import BondStrength

__all__ = ["bonded_groups"]


def bonded_groups(names: Iterable[str], bonds: Sequence[BondStrength]) -> list[list[str]]:
    """Names that bonds connect, in order; those without a bond alone. Bonds to other names are left out."""
    groups = {name: [name] for name in names}
    for bond in bonds:
        one, other = groups.get(bond.one), groups.get(bond.other)
        if one is None or other is None or one is other:
            continue
        one += other
        groups |= dict.fromkeys(other, one)
    order = {name: k for k, name in enumerate(groups)}
    found = {id(group): sorted(group, key=order.__getitem__) for group in groups.values()}
    return list(found.values())
