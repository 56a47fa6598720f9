"""What bodies in contact are made of: objects that deform, flesh, and bonds between objects (R92, R101, R105, R109)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.specification import Where

if TYPE_CHECKING:
    from warpjld.fem import Material

__all__ = ["LAWS", "Bonded", "FleshWish", "Physical"]

Law = Literal["linear", "neo-hooke", "mooney-rivlin"]
LAWS: tuple[Law, ...] = ("linear", "neo-hooke", "mooney-rivlin")


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
        digits: Those whose flesh is meshed, as ``index``, or ``palm``; empty for the whole hand. With the thumb comes
            its ball.
        element: Edge length of the elements [m].
        flesh: Young's modulus of what lies between skin and bone [Pa].
        skin: Young's modulus of the outermost layer of elements [Pa].
        poisson: Poisson's ratio of both.
        stiffening: Exponent of Fung's law; 0 is neo-Hookean.
        itself: Whether the skin may touch itself (R126).
        where: Place in a script, for messages.
    """

    digits: tuple[str, ...] = ()
    element: float = 0.003
    flesh: float = 34e3
    skin: float = 80e3
    poisson: float = 0.48
    stiffening: float = 3.0
    itself: bool = True
    where: Where | None = None


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
