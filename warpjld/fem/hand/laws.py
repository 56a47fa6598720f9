"""Default constitutive laws of a hand's regions (R101, R109)."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from warpjld.errors import InputError
from warpjld.fem.material.materials import Fung, Material, NeoHooke

__all__ = ["hand_laws"]

_POISSON = (0.3, 0.49)  # accepted for flesh, which is nearly incompressible; at .5 the bulk modulus is infinite
_CREASE = 1.0
"""Exponent of Fung's law between the bones of a joint."""


def hand_laws(
    mesh_regions: tuple[str, ...],
    *,
    flesh: float = 34e3,
    skin: float = 80e3,
    joint: float = 15e3,
    bone: float = 17e9,
    poisson: float = 0.48,
    stiffening: float = 3.0,
) -> dict[str, Material]:
    """Constitutive law of every region of a hand's mesh, chosen by the last part of the region's name.

    Moduli after Maeno et al. 1998, quoted from memory: subcutaneous fat 34 kPa, dermis 80 kPa (epidermis 136 kPa),
    ν = 0.48; bone 17 GPa. With these as small-strain moduli, Fung's law with β = 3 gives the force of a fingertip on a
    plate as measured on people: 1 N at 1.5 mm, then more than 3.5 N/mm (``examples/fingertip.py``). All laws are for
    large strain: flesh rotates with its finger, and a small-strain bone would give large spurious reactions.

    Args:
        mesh_regions: Region names, such as ``hand.flesh``, ``hand.skin``, ``hand.bone``; unknown ones are skipped.
            ``hand.skin:3/8`` consists of skin in three eighths of its volume, and of flesh in the rest.
        flesh: Small-strain Young's modulus of the tissue between skin and bone [Pa].
        skin: Small-strain Young's modulus of skin [Pa].
        joint: Young's modulus between the bones of a joint [Pa]: low, since it stands for cartilage that slides and
            skin that unfolds.
        bone: Young's modulus of bone [Pa].
        poisson: Poisson's ratio of flesh and skin.
        stiffening: Exponent β of Fung's law; 0 gives the neo-Hookean law.

    Raises:
        InputError: A Poisson's ratio out of range.
    """
    if not _POISSON[0] <= poisson <= _POISSON[1]:
        raise InputError(f"poisson: want {_POISSON[0]}…{_POISSON[1]} for flesh, got {poisson}")

    def soft(young: float, density: float) -> Material:
        if stiffening == 0.0:
            return NeoHooke(young, poisson, density)
        return Fung(young, stiffening, poisson, density)

    flesh_law = soft(flesh, 1050.0)
    made = {
        "pulp": flesh_law,
        "flesh": flesh_law,
        "skin": soft(skin, 1100.0),
        # some stiffening is needed: neo-Hookean flesh buckles in the crease of a joint beyond 60°
        "joint": NeoHooke(joint, poisson, 1050.0) if stiffening == 0.0 else Fung(joint, _CREASE, poisson, 1050.0),
        "bone": NeoHooke(bone, 0.3, 1900.0),
    }
    out: dict[str, Material] = {}
    for name in mesh_regions:
        kind, mixed, share = name.rpartition(".")[2].partition(":")
        if kind in made:
            out[name] = _mixed(flesh_law, made[kind], float(Fraction(share))) if mixed else made[kind]
    return out


def _mixed(one: Material, other: Material, share: float) -> Material:
    """Mixture of two laws of a kind under equal strain, the second over a share of the volume."""
    constants = {
        key: (1.0 - share) * getattr(one, key) + share * getattr(other, key)
        for key in ("c10", "c01", "bulk", "density", "stiffening")
    }
    return replace(other, **constants)
