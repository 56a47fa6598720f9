"""Specification of a contact simulation: materials, friction, grips to find and frames to solve, as plain records.

Records that stem from a script carry the location of their command (``where``), which error messages then name.
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
"""Default Coulomb coefficient: skin on aluminium (Seo 2009)."""
_EARTH = 9.81
"""Gravitational acceleration [m/s²]."""


@dataclass(frozen=True)
class FleshMaterial:
    """Deformable flesh of an actor (R105).

    Attributes:
        digits: Digits whose flesh is meshed, as ``index``, or ``palm``; empty for the whole hand. The thumb includes
            its ball (thenar).
        segments: Segments of a body whose flesh is meshed, as ``left.forearm`` (see ``segment_joints``).
        flexion: Whether flexion alone deforms the flesh from the first frame on, before any contact (B §1).
        bones: File with surfaces of its bones, in the units and axes of the rig's own file; None: cylinders.
        element: Edge length of the elements [m].
        flesh: Young's modulus of the tissue between skin and bone [Pa]; default: subcutaneous tissue (Maeno 1998).
        skin: Young's modulus of the outermost layer of elements [Pa]; default: dermis (Maeno 1998).
        poisson: Poisson's ratio of both.
        stiffening: Exponent of Fung's law; 0 is neo-Hookean.
        itself: Whether self-contact of the skin is considered (R126).
        where: Script location, for messages.

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
    """Two objects tied together until the traction between them exceeds a strength (R101, R102).

    Attributes:
        one, other: Names of the objects.
        normal, shear: Tensile and shear strength of the bond [Pa].
        parted: Points of the softer side at which it has opened already (``fem.contact.Bond``); empty for none.
        where: Script location, for messages.
    """

    one: str
    other: str
    normal: float
    shear: float
    where: SourceLocation | None = None
    parted: tuple[bool, ...] = ()


@dataclass(frozen=True)
class GripSpecification:
    """A grip to search for: the smallest closing that holds an object's weight, or the one that gives a total force.

    Attributes:
        actor: Actor whose hand closes.
        object: Object to hold; not needed with ``force``.
        first, last: Frames between which the hand closes; when lifting, it closes until ``middle`` and bears the whole
            weight at ``last``.
        channels: Flexions that close, as ``left.index.base.flexion``.
        most: Largest angle by which each may close [rad].
        lift: Whether the grip has to hold the object.
        weight: Weight of the object [N]; None: from its density.
        force: Target for the sum of the digits' forces [N].
        digits: Digits whose forces count, as ``index``; empty for all that close.
        share: ``muscles``: with a ``force``, every such digit closes by an angle of its own, so that all use the same
            share of their muscles, and the others stay; None: all joints close by the same angle.
        where: Script location, for messages.

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
    share: Literal["muscles"] | None = None
    where: SourceLocation | None = None

    @property
    def middle(self) -> float:
        """Frame at which the hand is closed."""
        return round(0.5 * (self.first + self.last)) if self.lift else self.last


@dataclass(frozen=True)
class SolveSpecification:
    """Frames at which contact is solved, and how.

    Attributes:
        first, last: Range of frames, both included; solving begins at the last frame before any contact.
        every: Step between solved frames; frames between are interpolated.
        method: ``augmented``: augmented Lagrangian method; ``paper``: the paper's staggered loop (R113).
        aitken: Whether the paper's loop uses Aitken relaxation.
        stop: Whether to stop at the first frame in which the muscles' strength is exceeded (R118).
        correct: Whether to open digits that bear more than their muscles' strength (R120).
        rigid: Whether digits follow the animation whatever force results. Otherwise, and unless ``stop`` or
            ``correct`` is set, a digit stops closing at the force limit of its muscles or the pressure limit of its
            skin.
        pressure: Largest contact pressure that skin bears [Pa]. The default leaves half of a fingertip's flesh between
            bone and wall: beyond it forces double every tenth of a millimetre, outside the range in which laws of flesh
            were measured.
        state: File of the state from which a stopped run resumes; None: no file.
        rate: Frames per second, for the duration of falls.
        where: Script location, for messages.

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
        """Whether digits stop closing at their force limits."""
        return not (self.rigid or self.stop or self.correct or self.method == "paper")


@dataclass(eq=False)
class ContactSpecification:
    """Complete specification of a contact simulation.

    Examples:
        >>> contact = wj.ContactSpecification(
        ...     flesh={"hand": wj.FleshMaterial(digits=("index",))}, pressing=wj.SolveSpecification(0, 8)
        ... )
        >>> contact.coefficient("hand", "plate")
        0.6

    Attributes:
        physical: Deformable objects by name.
        flesh: Actors with deformable flesh by name.
        points: Named point sets by object and name.
        prescribed: Prescribed state variables by object and point set.
        loads: External loads by object, point set and kind.
        spins: Steadily rotating objects by name.
        bonds: Tied pairs of objects.
        friction: Coulomb coefficients by pair of names, in alphabetical order.
        everywhere: Coefficient of all other pairs; None: that of their materials, else the default for skin, and 0 with
            the paper's loop, which has no friction.
        gravity: Gravitational acceleration [m/s²].
        strength: Force limits of digits that differ from the default [N], by actor and digit.
        grips: Grips to find, in the order of their frames.
        pressing: Frames to solve; None: nothing.
        grasped: Objects that digits have closed on, which only hands hold.
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
        """Validate friction coefficients, gravity and strengths.

        Raises:
            InputError: A number is out of range; names the field.
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
        """Acceleration [m/s²]: ``gravity``, or the earth's along -y if it is zero and a grip lifts an object."""
        lifts = any(grip.lift for grip in self.grips)
        return (0.0, -_EARTH, 0.0) if lifts and not any(self.gravity) else self.gravity

    @property
    def loaded(self) -> set[str]:
        """Names of objects with external loads."""
        return {name for name, _, _ in self.loads} | set(self.spins)

    def lifted(self, name: str) -> GripSpecification | None:
        """The grip that lifts an object; None if there is none."""
        return next((grip for grip in self.grips if grip.lift and grip.object == name), None)

    def coefficient(self, one: str, other: str) -> float:
        """Coulomb coefficient between two bodies by name."""
        paper = self.pressing is not None and self.pressing.method == "paper"
        known = pair_friction(self._matter(one), self._matter(other))
        usual = 0.0 if paper else _FRICTION if known is None else known
        return self.friction.get(name_pair(one, other), usual if self.everywhere is None else self.everywhere)

    def _matter(self, name: str) -> str | None:
        """Catalogue name of a body's material; None if it is not known."""
        if name in self.flesh:
            return "skin"
        return self.physical[name].made_of if name in self.physical else None

    def bond(self, one: str, other: str) -> BondStrength | None:
        """The bond between two objects; None if there is none."""
        for bonded in self.bonds:
            if name_pair(bonded.one, bonded.other) == name_pair(one, other):
                return bonded
        return None


def _want(holds: bool, name: str, what: str, got: object) -> None:
    """Check an argument.

    Raises:
        InputError: The condition does not hold; names the argument.
    """
    if not holds:
        raise InputError(f"{name}: want {what}, got {got}")


def name_pair(one: str, other: str) -> tuple[str, str]:
    """Two names in alphabetical order."""
    return (one, other) if one <= other else (other, one)


def located(error: InputError, where: SourceLocation | None) -> InputError:
    """The error with a script location added, unless it has one already."""
    if where is None or error.line is not None:
        return error
    path, line, column = where
    return InputError(str(error), path=path, line=line, column=column)
