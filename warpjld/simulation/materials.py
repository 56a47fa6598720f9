"""Catalogue of materials with sources of their constants, and Coulomb friction coefficients of pairs (R109).

Sources:

- CUED: Materials Data Book, 2003 edition, Cambridge University Engineering Department: the middle of its ranges of
  Young's modulus and density.
- Maeno: T. Maeno, K. Kobayashi, N. Yamazaki 1998, Relationship between the structure of human finger tissue and the
  location of tactile receptors, JSME Int. J. C 41, 94–100.
- Serway: R. A. Serway, J. W. Jewett, Physics for Scientists and Engineers, table of coefficients of friction: rough
  static ones of dry surfaces.
- Seo: N. J. Seo, T. J. Armstrong, P. Drinkaus 2009, A comparison of two methods of measuring static coefficient of
  friction at low normal forces, Ergonomics 52, 121–135: skin on aluminium and on rubber.
- Poisson's ratios are assumed, at values usual for the kind of material: 0.49 for nearly incompressible ones, 0.3 for
  metals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["FRICTIONS", "MATERIALS", "NamedMaterial", "pair_friction"]


@dataclass(frozen=True)
class NamedMaterial:
    """Constants of a material.

    Attributes:
        law: Constitutive law, valid under large rotations also for stiff materials.
        young: Young's modulus at small strain [Pa].
        poisson: Poisson's ratio.
        density: [kg/m³].
        source: Source of modulus and density.
    """

    law: Literal["neo-hooke"]
    young: float
    poisson: float
    density: float
    source: str


MATERIALS: dict[str, NamedMaterial] = {
    "rubber": NamedMaterial("neo-hooke", 2.0e6, 0.49, 925.0, "CUED: natural rubber, 1.5–2.5 MPa"),
    "silicone": NamedMaterial("neo-hooke", 12.5e6, 0.49, 1550.0, "CUED: silicone elastomers, 5–20 MPa"),
    "sponge": NamedMaterial("neo-hooke", 2.0e6, 0.3, 54.0, "CUED: flexible polymer foam of low density, 1–3 MPa"),
    "cork": NamedMaterial("neo-hooke", 31.5e6, 0.1, 180.0, "CUED: cork, 13–50 MPa"),
    "leather": NamedMaterial("neo-hooke", 0.3e9, 0.4, 930.0, "CUED: leather, 0.1–0.5 GPa"),
    "skin": NamedMaterial("neo-hooke", 80e3, 0.48, 1100.0, "Maeno: dermis"),
    "fat": NamedMaterial("neo-hooke", 34e3, 0.48, 950.0, "Maeno: subcutaneous tissue"),
    "wood": NamedMaterial("neo-hooke", 13e9, 0.35, 700.0, "CUED: wood along its grain, 6–20 GPa"),
    "plastic": NamedMaterial("neo-hooke", 2.0e9, 0.39, 1110.0, "CUED: ABS, 1.1–2.9 GPa"),
    "glass": NamedMaterial("neo-hooke", 70e9, 0.23, 2465.0, "CUED: soda-lime glass, 68–72 GPa"),
    "aluminium": NamedMaterial("neo-hooke", 75e9, 0.33, 2700.0, "CUED: aluminium alloys, 68–82 GPa"),
    "steel": NamedMaterial("neo-hooke", 207.5e9, 0.29, 7850.0, "CUED: low carbon steels, 200–215 GPa"),
}
"""Materials by name."""

FRICTIONS: dict[frozenset[str], tuple[float, str]] = {
    frozenset({"skin", "aluminium"}): (0.6, "Seo"),
    frozenset({"skin", "rubber"}): (0.9, "Seo"),
    frozenset({"steel"}): (0.74, "Serway"),
    frozenset({"aluminium", "steel"}): (0.61, "Serway"),
    frozenset({"glass"}): (0.94, "Serway"),
    frozenset({"wood"}): (0.4, "Serway: 0.25–0.5"),
}
"""Coulomb friction coefficient and source by pair of materials; one name alone: the material on itself."""


def pair_friction(one: str | None, other: str | None) -> float | None:
    """Coulomb friction coefficient of two materials; None if it is not known."""
    if one is None or other is None:
        return None
    found = FRICTIONS.get(frozenset({one, other}))
    return None if found is None else found[0]
