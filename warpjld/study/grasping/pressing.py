"""How the grasps of a study are pressed: weights that hang on the object, and the force that holds each."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.files.toml_table import TomlTable

__all__ = ["ContactPlan", "read_pressing"]

_TOLERANCE = 0.1


@dataclass(frozen=True)
class ContactPlan:
    """Contact of flesh and object, solved for every grasp that succeeds; the object is rigid and does not move.

    Attributes:
        weights: What hangs on the object, one a trial in turn [N].
        margin: The digits press with this many times what friction needs to hold the weight.
        element: Edge length of the elements of flesh [m].
        most: Angle by which each joint may bend on [°].
    """

    weights: tuple[float, ...]
    margin: float = 1.5
    element: float = 0.005
    most: float = 20.0

    def force(self, weight: float, friction: float) -> float:
        """Sum of the digits' forces [N] that is asked for: margin · W / μ, since normal forces N in all hold μ N of a
        weight W along the surface."""
        return self.margin * weight / friction

    def kept(self, force: float, *, asked: float) -> bool:
        """Whether a force at the end is the one asked for [N], within 10 %."""
        return abs(force - asked) <= _TOLERANCE * asked


def read_pressing(table: TomlTable) -> ContactPlan:
    """Settings from the table [contact]."""
    table.needed("weights")
    weights = table.numbers("weights", (), above=0.0)

    def number(key: str, *, above: float, most: float) -> float:
        value = table.number(key, getattr(ContactPlan, key), above=above, most=most)
        assert value is not None
        return value

    found = ContactPlan(
        weights=weights,
        margin=number("margin", above=0.0, most=100.0),
        element=number("element", above=0.0, most=0.02),
        most=number("most", above=0.0, most=90.0),
    )
    table.finish()
    return found
