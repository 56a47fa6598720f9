"""What is asked of a simulation of contact: materials, friction, grips to find and frames to solve, as plain records.

Whoever fills them, commands of a script or a program in Python, says where each was asked for, so that messages can.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.materials import pair_friction
from warpjld.simulation.object_loads import ObjectLoad, ObjectSpin
from warpjld.simulation.object_material import LAWS, ObjectMaterial, SourceLocation
from warpjld.simulation.state_variables import Points, PrescribedPoints
from warpjld.skeleton import DIGITS

__all__ = [
    "LAWS",
    "BondStrength",
    "ContactSpecification",
    "FleshMaterial",
    "GripSpecification",
    "ObjectMaterial",
    "SolveSpecification",
    "SourceLocation",
    "located",
    "name_pair",
]

_FRICTION = 0.6
"""Skin on aluminium (Seo 2009)."""
_EARTH = 9.81
"""[m/s²]"""


@dataclass(frozen=True)
class FleshMaterial:
    """An actor whose flesh deforms (R105).

    Attributes:
        digits: Those whose flesh is meshed, as ``index``, or ``palm``; empty for the whole hand. With the thumb comes
            its ball.
        segments: Those of a body whose flesh is meshed, as ``left.forearm`` (see ``segment_joints``).
        flexion: Whether bending alone deforms it from the first frame on, before anything touches (B §1).
        bones: File with surfaces of its bones, in the units and axes of the rig's own file; None: round ones.
        element: Edge length of the elements [m].
        flesh: Young's modulus of what lies between skin and bone [Pa].
        skin: Young's modulus of the outermost layer of elements [Pa].
        poisson: Poisson's ratio of both.
        stiffening: Exponent of Fung's law; 0 is neo-Hookean.
        itself: Whether the skin may touch itself (R126).
        where: Place in a script, for messages.

    Examples:
        >>> wj.FleshMaterial(digits=("index",), element=0.003).flesh  # Pa
        34000.0
    """

    digits: tuple[str, ...] = ()
    segments: tuple[str, ...] = ()
    flexion: bool = False
    bones: Path | None = None
    element: float = 0.003
    flesh: float = 34e3
    skin: float = 80e3
    poisson: float = 0.48
    stiffening: float = 3.0
    itself: bool = True
    where: SourceLocation | None = None

    def __post_init__(self) -> None:
        for name in ("element", "flesh", "skin"):
            _want(getattr(self, name) > 0.0, name, "a number above 0", getattr(self, name))
        _want(0.0 <= self.poisson < 0.5, "poisson", "a ratio from 0 to below 0.5", self.poisson)
        _want(self.stiffening >= 0.0, "stiffening", "an exponent of 0 or more", self.stiffening)
        unknown = [digit for digit in self.digits if digit not in (*DIGITS, "palm")]
        _want(not unknown, "digits", f"of {', '.join(DIGITS)} and palm", unknown)
        _want(not (self.digits and self.segments), "segments", "digits or segments, not both", self.segments)


@dataclass(frozen=True)
class BondStrength:
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
    where: SourceLocation | None = None


@dataclass(frozen=True)
class GripSpecification:
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

    Examples:
        >>> closing = ("left.index.base.flexion", "left.thumb.base.flexion")
        >>> lift = wj.GripSpecification("hand", "ball", 31, 41, closing, most=0.3, lift=True, weight=0.5)
        >>> lift.middle
        36
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
    where: SourceLocation | None = None

    @property
    def middle(self) -> float:
        """Frame at which the hand has closed."""
        return round(0.5 * (self.first + self.last)) if self.lift else self.last


@dataclass(frozen=True)
class SolveSpecification:
    """Frames to solve contact at.

    Attributes:
        first, last: Both included; solving begins with the last of them before anything touches.
        every: Frames between two that are solved; those between are interpolated.
        method: The default, or the paper's loop (R113).
        aitken: Relaxation of the paper's loop.
        stop: Whether to stop where the muscles can do no more (R118).
        correct: Whether to open digits that bear more than their muscles can (R120).
        rigid: Whether digits close as the animation has it, however hard they then press. Otherwise, and unless it
            stops or corrects, a digit closes no farther than its muscles can press or its skin bears.
        pressure: What skin bears [Pa]. By default what leaves half of a fingertip's flesh between bone and wall: beyond
            it forces double every tenth of a millimetre, and laws of flesh were never measured.
        state: File the state is kept in, so that a stopped run goes on; None keeps none.
        rate: Frames a second: how long what falls takes.
        where: Place in a script, for messages.

    Examples:
        >>> wj.SolveSpecification(0, 8, every=2).method
        'augmented'
    """

    first: int
    last: int
    every: int = 1
    method: Literal["augmented", "paper"] = "augmented"
    aitken: bool = False
    stop: bool = False
    correct: bool = False
    state: str | None = None
    where: SourceLocation | None = None
    rigid: bool = False
    pressure: float = 3e5
    rate: float = 30.0

    def __post_init__(self) -> None:
        _want(0.0 < self.rate < np.inf, "rate", "frames a second above 0", self.rate)
        _want(0.0 < self.pressure < np.inf, "pressure", "a pressure above 0 Pa", self.pressure)
        _want(self.last > self.first, "last", f"a frame after the first ({self.first})", self.last)
        _want(self.every >= 1, "every", "1 frame or more", self.every)
        _want(self.method in ("augmented", "paper"), "method", "augmented or paper", self.method)

    @property
    def limited(self) -> bool:
        """Whether digits stop where they can press no harder."""
        return not (self.rigid or self.stop or self.correct or self.method == "paper")


@dataclass(eq=False)
class ContactSpecification:
    """Everything that is asked of contact.

    Examples:
        >>> contact = wj.ContactSpecification(
        ...     flesh={"hand": wj.FleshMaterial(digits=("index",))}, pressing=wj.SolveSpecification(0, 8)
        ... )
        >>> contact.coefficient("hand", "plate")
        0.6

    Attributes:
        physical: Objects that deform, by name.
        flesh: Actors whose flesh deforms, by name.
        points: Named points by object and name.
        prescribed: State variables by object and points.
        loads: Forces on objects, by object, points and kind.
        spins: Objects that turn steadily, by name.
        bonds: Objects that stick together.
        friction: Coefficients by pair of names, in alphabetical order.
        everywhere: Coefficient of all other pairs; None: that of their materials, of skin where it is not known, or
            none with the paper's loop, which knows none.
        gravity: [m/s²].
        strength: Largest force of digits [N], by actor and digit, where it is not the default.
        grips: Grips to find, in the order of their frames.
        pressing: What to solve, if anything.
        grasped: Objects that digits have closed on: hands alone are to hold them.
    """

    physical: dict[str, ObjectMaterial] = field(default_factory=dict)
    flesh: dict[str, FleshMaterial] = field(default_factory=dict)
    points: dict[tuple[str, str], Points] = field(default_factory=dict)
    prescribed: dict[tuple[str, str], PrescribedPoints] = field(default_factory=dict)
    loads: dict[tuple[str, str, str], ObjectLoad] = field(default_factory=dict)
    spins: dict[str, ObjectSpin] = field(default_factory=dict)
    bonds: list[BondStrength] = field(default_factory=list)
    friction: dict[tuple[str, str], float] = field(default_factory=dict)
    everywhere: float | None = None
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    strength: dict[str, dict[str, float]] = field(default_factory=dict)
    grips: list[GripSpecification] = field(default_factory=list)
    pressing: SolveSpecification | None = None
    grasped: tuple[str, ...] = ()

    def check(self) -> None:
        """Refuse numbers that are none.

        Raises:
            InputError: Names the field.
        """
        for coefficient in (*self.friction.values(), *(() if self.everywhere is None else (self.everywhere,))):
            _want(0.0 <= coefficient < np.inf, "friction", "coefficients of 0 or more", coefficient)
        _want(
            len(self.gravity) == 3 and bool(np.isfinite(self.gravity).all()), "gravity", "three numbers", self.gravity
        )
        for limits in self.strength.values():
            _want(all(force > 0.0 for force in limits.values()), "strength", "forces above 0 N", limits)

    @property
    def pull(self) -> tuple[float, float, float]:
        """Acceleration [m/s²]: as asked, and that of the earth, downwards, where something is lifted without a word."""
        lifts = any(grip.lift for grip in self.grips)
        return (0.0, -_EARTH, 0.0) if lifts and not any(self.gravity) else self.gravity

    @property
    def loaded(self) -> set[str]:
        """Objects that forces act on."""
        return {name for name, _, _ in self.loads} | set(self.spins)

    def lifted(self, name: str) -> GripSpecification | None:
        """The grip that is to hold an object, if any."""
        return next((grip for grip in self.grips if grip.lift and grip.object == name), None)

    def coefficient(self, one: str, other: str) -> float:
        """Friction between two."""
        paper = self.pressing is not None and self.pressing.method == "paper"
        known = pair_friction(self._matter(one), self._matter(other))
        usual = 0.0 if paper else _FRICTION if known is None else known
        return self.friction.get(name_pair(one, other), usual if self.everywhere is None else self.everywhere)

    def _matter(self, name: str) -> str | None:
        """What a body is made of, where that is known."""
        if name in self.flesh:
            return "skin"
        return self.physical[name].made_of if name in self.physical else None

    def bond(self, one: str, other: str) -> BondStrength | None:
        """The bond between two objects, if any."""
        for bonded in self.bonds:
            if name_pair(bonded.one, bonded.other) == name_pair(one, other):
                return bonded
        return None


def _want(holds: bool, name: str, what: str, got: object) -> None:
    """Raise where an argument is none.

    Raises:
        InputError: Names it.
    """
    if not holds:
        raise InputError(f"{name}: want {what}, got {got}")


def name_pair(one: str, other: str) -> tuple[str, str]:
    """Two names in alphabetical order."""
    return (one, other) if one <= other else (other, one)


def located(error: InputError, where: SourceLocation | None) -> InputError:
    """The same error at a place in a script, unless it has one."""
    if where is None or error.line is not None:
        return error
    path, line, column = where
    return InputError(str(error), path=path, line=line, column=column)
