"""Material and wall of a deformable object (R92, R109)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.fem import Material

__all__ = ["LAWS", "Law", "ObjectMaterial", "SourceLocation"]

SourceLocation = tuple[str, int, int]
"""File, line and column of a script command, for messages."""

Law = Literal["linear", "neo-hooke", "mooney-rivlin"]
LAWS: tuple[Law, ...] = ("linear", "neo-hooke", "mooney-rivlin")
"""Names of the constitutive laws."""


@dataclass(frozen=True)
class ObjectMaterial:
    """Material, wall and inner pressure of a deformable object (R92, R109).

    Attributes:
        law: Constitutive law.
        young: Young's modulus at small strain [Pa].
        poisson: Poisson's ratio at small strain.
        density: [kg/m³].
        wall: Thickness of the wall of a hollow object [m]; 0 for a solid one.
        pressure: Gauge pressure inside a hollow object [Pa] (R111).
        element: Edge length of its elements [m]; None chooses it from the object's size.
        made_of: Name in the catalogue of materials, if it is from there; determines its friction coefficients.
        prestress: Initial Cauchy stress in the object's axes, xx yy zz xy yz zx [Pa] (R98); relaxes where the object
            is not constrained.
        regions: Materials of regions of its volume mesh file, by name; other regions have the object's (R141).
        where: Script location, for messages.

    Examples:
        >>> rubber = wj.ObjectMaterial(young=4e5, wall=0.003, pressure=8000)  # Pa, m, Pa
        >>> round(rubber.material().young)  # Pa
        400000
    """

    law: Law = "neo-hooke"
    young: float = 1e6
    poisson: float = 0.45
    density: float = 1000.0
    wall: float = 0.0
    pressure: float = 0.0
    element: float | None = None
    where: SourceLocation | None = None
    prestress: tuple[float, ...] = (0.0,) * 6
    made_of: str | None = None
    regions: tuple[tuple[str, ObjectMaterial], ...] = ()

    def __post_init__(self) -> None:
        self.material()
        if len(self.prestress) != 6 or not np.isfinite(self.prestress).all():
            raise InputError(f"prestress: want six finite stresses in Pa, xx yy zz xy yz zx, got {self.prestress}")
        if not (np.isfinite(self.wall) and self.wall >= 0.0):
            raise InputError(f"wall: want a thickness of 0 m (solid) or more, got {self.wall:g}")
        if not np.isfinite(self.pressure):
            raise InputError(f"pressure: want a finite pressure in Pa, got {self.pressure:g}")
        if self.pressure and not self.wall:
            raise InputError("pressure: only a hollow object has an inside to put under pressure")

    def laws(self, name: str, regions: Sequence[str]) -> dict[str, Material]:
        """Laws of the mesh's regions, keyed by ``name.region``, or by ``name`` if there is only one region."""
        own, material = dict(self.regions), self.material()
        if len(regions) < 2:
            return {name: own[regions[0]].material() if regions and regions[0] in own else material}
        return {f"{name}.{region}": own[region].material() if region in own else material for region in regions}

    def material(self) -> Material:
        """Constitutive law with its constants.

        Raises:
            InputError: Modulus, Poisson's ratio or density out of range.
        """
        from warpjld.fem import LinearElastic, MooneyRivlin, NeoHooke

        if self.law == "linear":
            return LinearElastic(self.young, self.poisson, self.density)
        if self.law == "neo-hooke":
            return NeoHooke(self.young, self.poisson, self.density)
        # c10 : c01 = 4 : 1, usual for rubber; 2 (c10 + c01) is the shear modulus at small strain
        shear = self.young / (2.0 * (1.0 + self.poisson))
        return MooneyRivlin(0.4 * shear, 0.1 * shear, self.poisson, self.density)
