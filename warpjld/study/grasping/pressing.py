"""Settings of contact in a grasp study: weights to hold, and the grip force that holds each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast, get_args

from warpjld.files.toml_table import TomlTable

__all__ = ["ContactPlan", "read_pressing"]

_Sharing = Literal["angles", "muscles"]

_TOLERANCE = 0.1  # of the force asked for: a trial within it has reached it


@dataclass(frozen=True)
class ContactPlan:
    """Settings of the contact solve of flesh and object, done for every successful grasp; the object is fixed.

    Attributes:
        weights: Weights to hold; trials take them in turn [N].
        margin: Safety factor: grip force over the least force at which friction holds the weight.
        element: Edge length of the elements of flesh [m].
        most: Largest further flexion of each joint [degrees].
        share: ``angles``: all digits bend on by the same angle; ``muscles``: each by its own, so that all use the same
            share of their muscles.
    """

    weights: tuple[float, ...]
    margin: float = 1.5
    element: float = 0.005
    most: float = 20.0
    share: _Sharing = "angles"

    def force(self, weight: float, friction: float) -> float:
        """Requested sum of the digits' forces [N]: margin · W / μ, since normal forces with the sum N hold a weight
        W ≤ μ N along the surface."""
        return self.margin * weight / friction

    def kept(self, force: float, *, asked: float) -> bool:
        """Whether the final force [N] is within 10 % of the requested one."""
        return abs(force - asked) <= _TOLERANCE * asked


def read_pressing(table: TomlTable) -> ContactPlan:
    """Read the settings from the table ``[contact]`` of a study's TOML file."""
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
        share=cast(_Sharing, table.text("share", ContactPlan.share, known=get_args(_Sharing))),
    )
    table.finish()
    return found
