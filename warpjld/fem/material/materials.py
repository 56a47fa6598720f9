"""Constitutive laws, one per region or per element (R101–R103, R109)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["Fung", "LinearElastic", "Material", "MaterialWarning", "MooneyRivlin", "NeoHooke", "laws_of"]

_STIFFEST = 1e18
"""Largest modulus [Pa], a million times that of diamond, and density [kg/m³]; the smallest modulus is its inverse."""
_USUAL_POISSON = 0.49  # larger values cause a warning
LINEAR, LINEAR_FULL, NEO_HOOKE, MOONEY_RIVLIN, FUNG, NEO_HOOKE_FULL = range(6)
"""Numbers of the laws, as in ``warpjld_kernels.fem_laws``."""


class MaterialWarning(UserWarning):
    """A usable material that costs accuracy or time."""


@dataclass(frozen=True)
class Material:
    """Constitutive law of an element.

    Attributes:
        kind: Law, as numbered in ``warpjld_kernels.fem_laws``.
        c10: Half the shear modulus, or first Mooney–Rivlin constant [Pa].
        c01: Second Mooney–Rivlin constant [Pa].
        bulk: Bulk modulus [Pa].
        density: Mass per rest volume [kg/m³].
        stiffening: Fung's exponent β.
    """

    kind: int
    c10: float
    c01: float
    bulk: float
    density: float = 1000.0
    stiffening: float = 0.0

    @property
    def large_strain(self) -> bool:
        """Whether the law is for large strain, which needs Newton's method."""
        return self.kind >= NEO_HOOKE

    @property
    def shear(self) -> float:
        """Shear modulus at small strain [Pa]."""
        return 2.0 * (self.c10 + self.c01)

    @property
    def young(self) -> float:
        """Young's modulus at small strain [Pa]."""
        return 9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)

    @property
    def poisson(self) -> float:
        """Poisson's ratio at small strain."""
        return (3.0 * self.bulk - 2.0 * self.shear) / (6.0 * self.bulk + 2.0 * self.shear)


def LinearElastic(young: float, poisson: float, density: float = 1000.0, *, mean_dilatation: bool = True) -> Material:
    """Hooke's law at small strain, with B-bar elements; without ``mean_dilatation`` elements lock near ν = ½.

    Args:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio, −1 < ν < ½; above .49 with a warning.
        density: [kg/m³].
        mean_dilatation: One pressure per element (B-bar).

    Raises:
        InputError: A modulus, ratio or density out of range.
    """
    shear, bulk = _moduli(young, poisson, density)
    return Material(LINEAR if mean_dilatation else LINEAR_FULL, 0.5 * shear, 0.0, bulk, density)


def NeoHooke(young: float, poisson: float, density: float = 1000.0, *, mean_dilatation: bool = True) -> Material:
    """W = μ/2 (Ī₁ − 3) + κ/2 (θ − 1)², θ the element's mean volume ratio: rubber and flesh at large strain.

    Without ``mean_dilatation`` θ is that of each integration point, as in plain 8-node elements: these lock near ν = ½.

    Args:
        young: Young's modulus at small strain [Pa].
        poisson: Poisson's ratio at small strain, −1 < ν < ½; above .49 with a warning.
        density: [kg/m³].
        mean_dilatation: One volume ratio, and so one pressure, per element.

    Raises:
        InputError: A modulus, ratio or density out of range.
    """
    shear, bulk = _moduli(young, poisson, density)
    return Material(NEO_HOOKE if mean_dilatation else NEO_HOOKE_FULL, 0.5 * shear, 0.0, bulk, density)


def MooneyRivlin(c10: float, c01: float, poisson: float = 0.49, density: float = 1000.0) -> Material:
    """W = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) + κ/2 (θ − 1)².

    Args:
        c10: First constant [Pa].
        c01: Second constant [Pa], ≥ 0.
        poisson: Poisson's ratio at small strain, which gives κ.
        density: [kg/m³].

    Raises:
        InputError: Constants out of range.
    """
    if not c01 >= 0.0:
        raise InputError(f"c01: want a constant ≥ 0 Pa, got {c01}")
    shear, bulk = _moduli(4.0 * (c10 + c01) * (1.0 + poisson), poisson, density)
    del shear
    return Material(MOONEY_RIVLIN, c10, c01, bulk, density)


def Fung(young: float, stiffening: float, poisson: float = 0.48, density: float = 1000.0) -> Material:
    """W = μ/2β (exp(β (Ī₁ − 3)) − 1) + κ/2 (θ − 1)²: skin and flesh, whose stiffness grows exponentially with strain.

    Demiray 1972 (doi:10.1016/0021-9290(72)90047-4), the isotropic form of Fung's law. β = 0 would be ``NeoHooke``.

    Args:
        young: Young's modulus at small strain [Pa].
        stiffening: β > 0; the modulus is e times as large where Ī₁ − 3 = 1 / β (stretch 1.6 for β = 1, 1.2 for β = 10).
        poisson: Poisson's ratio at small strain.
        density: [kg/m³].

    Raises:
        InputError: A modulus, exponent, ratio or density out of range.
    """
    if not 0.0 < stiffening <= 100.0:
        raise InputError(f"stiffening: want an exponent above 0, at most 100, got {stiffening}")
    shear, bulk = _moduli(young, poisson, density)
    return Material(FUNG, 0.5 * shear, 0.0, bulk, density, float(stiffening))


def _moduli(young: float, poisson: float, density: float) -> tuple[float, float]:
    if not 1.0 / _STIFFEST <= young <= _STIFFEST:
        raise InputError(f"young: want a modulus above 0 Pa, {1.0 / _STIFFEST:g} to {_STIFFEST:g}, got {young}")
    if not -1.0 < poisson < 0.5:
        raise InputError(f"poisson: want −1 < ν < 0.5 (0.49 to 0.4999 for rubber and flesh), got {poisson}")
    if not 0.0 <= density <= _STIFFEST:
        raise InputError(f"density: want 0 kg/m³ or more, at most {_STIFFEST:g}, got {density}")
    if poisson > _USUAL_POISSON:
        warnings.warn(
            f"Poisson's ratio {poisson}: above {_USUAL_POISSON} the solver needs several times the iterations",
            MaterialWarning,
            stacklevel=3,
        )
    return young / (2.0 * (1.0 + poisson)), young / (3.0 * (1.0 - 2.0 * poisson))


def laws_of(mesh: HexMesh, materials: Material | Mapping[str, Material]) -> tuple[Ints32, Array, Array]:
    """Kind (E,), constants c₁₀, c₀₁, κ, β (E, 4) and density (E,) of every element.

    Args:
        mesh: The mesh.
        materials: One law, or one per region name.

    Raises:
        InputError: A region without a law, or a law for an unknown region.
    """
    if isinstance(materials, Material):
        materials = dict.fromkeys(mesh.region_names, materials)
    for name in materials:
        mesh.region(name)
    missing = [name for name in mesh.region_names if name not in materials]
    if missing:
        raise InputError(f"materials: region '{missing[0]}' has no material; regions: {', '.join(mesh.region_names)}")
    chosen = [materials[name] for name in mesh.region_names]
    kinds = np.array([m.kind for m in chosen], dtype=np.int32)[mesh.regions]
    constants = np.array([(m.c10, m.c01, m.bulk, m.stiffening) for m in chosen])[mesh.regions]
    return kinds, constants, np.array([m.density for m in chosen])[mesh.regions]
