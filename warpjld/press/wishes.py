"""What a scene says about contact: plain records, filled by the commands of the language."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.fem import Material
    from warpjld.motion import Track

__all__ = [
    "LAWS",
    "Barred",
    "Bonded",
    "ContactWishes",
    "FleshWish",
    "GripWish",
    "Physical",
    "Points",
    "Prescribing",
    "Pressing",
    "Where",
    "pair",
    "placed",
]

Where = tuple[str, int, int]
"""File, line and column of a command, for messages."""

Law = Literal["linear", "neo-hooke", "mooney-rivlin"]
LAWS: tuple[Law, ...] = ("linear", "neo-hooke", "mooney-rivlin")
_FRICTION = 0.6
"""Skin on aluminium (Seo 2009)."""
_EARTH = 9.81
"""[m/s²]"""


@dataclass(frozen=True)
class Physical:
    """An object that deforms (R92, R109).

    Attributes:
        law: Constitutive law.
        young: Young's modulus at small strain [Pa].
        poisson: Poisson's ratio at small strain.
        density: [kg/m³].
        wall: Thickness of its wall [m]; 0 for a solid object.
        pressure: Inside a hollow one, above that outside [Pa] (R111).
        element: Edge length of its elements [m]; None chooses.
        where: Place in a script, for messages.
    """

    law: Law = "neo-hooke"
    young: float = 1e6
    poisson: float = 0.45
    density: float = 1000.0
    wall: float = 0.0
    pressure: float = 0.0
    element: float | None = None
    where: Where | None = None

    def __post_init__(self) -> None:
        self.material()
        if not (np.isfinite(self.wall) and self.wall >= 0.0):
            raise InputError(f"wall: want a thickness of 0 m (solid) or more, got {self.wall:g}")
        if not np.isfinite(self.pressure):
            raise InputError(f"pressure: want a finite pressure in Pa, got {self.pressure:g}")
        if self.pressure and not self.wall:
            raise InputError("pressure: only a hollow object has an inside to put under pressure")

    def material(self) -> Material:
        """The law with its constants.

        Raises:
            InputError: A modulus, ratio or density that no material has.
        """
        from warpjld.fem import LinearElastic, MooneyRivlin, NeoHooke

        if self.law == "linear":
            return LinearElastic(self.young, self.poisson, self.density)
        if self.law == "neo-hooke":
            return NeoHooke(self.young, self.poisson, self.density)
        # Mooney and Rivlin's constants in the usual ratio of rubber, of the same modulus at small strain
        shear = self.young / (2.0 * (1.0 + self.poisson))
        return MooneyRivlin(0.4 * shear, 0.1 * shear, self.poisson, self.density)


@dataclass(frozen=True)
class FleshWish:
    """An actor whose flesh deforms (R105).

    Attributes:
        digits: Those whose flesh is meshed, as ``index``, or ``palm``; empty for the whole hand.
        element: Edge length of the elements [m].
        flesh: Young's modulus of what lies between skin and bone [Pa].
        skin: Young's modulus of the skin [Pa].
        poisson: Poisson's ratio of both.
        stiffening: Exponent of Fung's law; 0 is neo-Hookean.
        itself: Whether the skin may touch itself (R126).
    """

    digits: tuple[str, ...] = ()
    element: float = 0.003
    flesh: float = 34e3
    skin: float = 80e3
    poisson: float = 0.48
    stiffening: float = 3.0
    itself: bool = True


@dataclass(frozen=True)
class Points:
    """Points of a deformable object (R128).

    Attributes:
        kind: ``all``, the ``upper`` or ``lower`` end along an axis, or those ``near`` a place.
        axis: 0, 1 or 2, of the object's own frame.
        share: Of its extent along the axis.
        centre: Of a ball on the stage, where the object is at first [m].
        radius: Its radius [m].
    """

    kind: Literal["all", "upper", "lower", "near"] = "all"
    axis: int = 0
    share: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0

    def choose(self, local: NDArray[np.float64], stage: NDArray[np.float64]) -> NDArray[np.int64]:
        """Numbers of the points that are meant, of positions in the object's frame and on the stage (n, 3) [m].

        Raises:
            InputError: None is.
        """
        if self.kind == "all":
            return np.arange(len(local))
        if self.kind == "near":
            chosen = np.linalg.norm(stage - np.array(self.centre), axis=1) <= self.radius
        else:
            x = local[:, self.axis]
            low, high = float(x.min()), float(x.max())
            reach = (self.share + 1e-9) * (high - low)
            chosen = x >= high - reach if self.kind == "upper" else x <= low + reach
        if not chosen.any():
            raise InputError("no point of the object lies there")
        return np.flatnonzero(chosen)


@dataclass(eq=False)
class Prescribing:
    """A state variable: displacements of object points from where they are at first, over keys (R128).

    Attributes:
        points: Which.
        tracks: Keys of the prescribed axes ``x``, ``y``, ``z`` [m]: three of them (VECTOR) or fewer.
        held: Whether the points go where the object's place goes; ``tracks`` then displace them from there.
        until: Frame after which points that are held are free.
    """

    points: Points
    tracks: dict[str, Track] = field(default_factory=dict)
    held: bool = False
    until: float = float("inf")

    def holds(self, frame: float) -> bool:
        """Whether the points go with the object at a frame."""
        return self.held and frame <= self.until


@dataclass(frozen=True)
class Bonded:
    """Two objects that are one until the traction between them is too much (R101, R102).

    Attributes:
        one, other: Objects.
        normal, shear: Strength [Pa].
        where: Place in a script, for messages.
    """

    one: str
    other: str
    normal: float
    shear: float
    where: Where | None = None


@dataclass(eq=False)
class Barred:
    """Barr's deformations of an object, over keys (R94).

    Attributes:
        axis: ``x``, ``y`` or ``z``.
        tracks: Keys of ``taper`` (share), ``twist`` and ``bend`` [rad].
    """

    axis: Literal["x", "y", "z"]
    tracks: dict[str, Track] = field(default_factory=dict)

    def at(self, kind: str, frame: float) -> float:
        """The amount at a frame."""
        track = self.tracks.get(kind)
        return 0.0 if track is None else float(track.spline(frame))


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


def placed(error: InputError, where: Where | None) -> InputError:
    """The same error at a place in a script, unless it has one."""
    if where is None or error.line is not None:
        return error
    path, line, column = where
    return InputError(str(error), path=path, line=line, column=column)


def pair(one: str, other: str) -> tuple[str, str]:
    """Two names in alphabetical order."""
    return (one, other) if one <= other else (other, one)
