"""What a scene says about contact: plain records, filled by the commands of the language."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from warpjld.simulation.specification import Bonded, FleshWish, Physical
from warpjld.simulation.state_variables import Points, Prescribing
from warpjld.simulation.specification import Where

__all__ = ["ContactWishes", "GripWish", "Pressing", "pair"]

_FRICTION = 0.6
"""Skin on aluminium (Seo 2009)."""
_EARTH = 9.81
"""[m/s²]"""


@dataclass(frozen=True)
class GripWish:
    """A grip that is to be found: the gentlest that holds an object's weight, or the one that presses with a force.

    Attributes:
        actor: Whose hand closes.
        object: What it holds; a force needs none.
        first, last: Frames between which it closes; where it lifts, it closes up to half-way and has the weight at the
            last.
        channels: Flexions that close, as ``left.index.base.flexion``.
        most: Angle by which each may close at most [rad].
        lift: Whether it is to hold the object.
        weight: Of the object [N]; None: as its density has it.
        force: Wished sum of the forces of the digits [N].
        digits: Those whose forces count, as ``index``; none for all that close.
        where: Place in a script, for messages.
    """

    actor: str
    object: str
    first: float
    last: float
    channels: tuple[str, ...]
    most: float
    lift: bool = False
    weight: float | None = None
    force: float | None = None
    digits: tuple[str, ...] = ()
    where: Where | None = None

    @property
    def middle(self) -> float:
        """Frame at which the hand has closed."""
        return round(0.5 * (self.first + self.last)) if self.lift else self.last


@dataclass(frozen=True)
class Pressing:
    """Frames to solve contact at.

    Attributes:
        first, last: Both included; solving begins with the last of them before anything touches.
        every: Frames between two that are solved; those between are interpolated.
        method: The default, or the paper's loop (R113).
        aitken: Relaxation of the paper's loop.
        stop: Whether to stop where the muscles can do no more (R118).
        correct: Whether to open digits that bear more than their muscles can (R120).
        state: File the state is kept in, so that a stopped run goes on; None keeps none.
        where: Place in a script, for messages.
    """

    first: int
    last: int
    every: int = 1
    method: Literal["augmented", "paper"] = "augmented"
    aitken: bool = False
    stop: bool = False
    correct: bool = False
    state: str | None = None
    where: Where | None = None


@dataclass(eq=False)
class ContactWishes:
    """Everything a scene says about contact.

    Attributes:
        physical: Objects that deform, by name.
        flesh: Actors whose flesh deforms, by name.
        points: Named points by object and name.
        prescribed: State variables by object and points.
        bonds: Objects that stick together.
        friction: Coefficients by pair of names, in alphabetical order.
        everywhere: Coefficient of all other pairs; None: that of skin, or none with the paper's loop, which knows none.
        gravity: [m/s²].
        strength: Largest force of digits [N], by actor and digit, where it is not the default.
        grips: Grips to find, in the order of their frames.
        pressing: What to solve, if anything.
    """

    physical: dict[str, Physical] = field(default_factory=dict)
    flesh: dict[str, FleshWish] = field(default_factory=dict)
    points: dict[tuple[str, str], Points] = field(default_factory=dict)
    prescribed: dict[tuple[str, str], Prescribing] = field(default_factory=dict)
    bonds: list[Bonded] = field(default_factory=list)
    friction: dict[tuple[str, str], float] = field(default_factory=dict)
    everywhere: float | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    strength: dict[str, dict[str, float]] = field(default_factory=dict)
    grips: list[GripWish] = field(default_factory=list)
    pressing: Pressing | None = None

    @property
    def pull(self) -> tuple[float, float, float]:
        """Acceleration [m/s²]: as asked, and that of the earth, downwards, where something is lifted without a word."""
        lifts = any(wish.lift for wish in self.grips)
        return (0.0, -_EARTH, 0.0) if lifts and not any(self.gravity) else self.gravity

    def lifted(self, name: str) -> GripWish | None:
        """The grip that is to hold an object, if any."""
        return next((wish for wish in self.grips if wish.lift and wish.object == name), None)

    def coefficient(self, one: str, other: str) -> float:
        """Friction between two."""
        paper = self.pressing is not None and self.pressing.method == "paper"
        usual = 0.0 if paper else _FRICTION
        return self.friction.get(pair(one, other), usual if self.everywhere is None else self.everywhere)

    def bond(self, one: str, other: str) -> Bonded | None:
        """The bond between two objects, if any."""
        for bonded in self.bonds:
            if pair(bonded.one, bonded.other) == pair(one, other):
                return bonded
        return None


def pair(one: str, other: str) -> tuple[str, str]:
    """Two names in alphabetical order."""
    return (one, other) if one <= other else (other, one)
