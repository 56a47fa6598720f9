"""Default constitutive laws of a hand's regions (R101, R109)."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

from warpjld.errors import InputError
from warpjld.fem.material.materials import Fung, Material, NeoHooke

__all__ = ["hand_laws"]

_POISSON = (0.3, 0.49)  # of flesh, which keeps its volume; from .5 there is no bulk modulus
_CREASE = 1.0
"""Fung's exponent between the bones of a joint."""


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
    """A law for every region of a hand's mesh, by the last part of its name.

    Moduli after Maeno et al. 1998, quoted from memory: subcutaneous fat 34 kPa, dermis 80 kPa (epidermis 136 kPa),
    ν = 0.48; bone 17 GPa. With them as moduli at small strain, Fung's law with β = 3 presses a fingertip on a plate as
    people do: 1 N at 1.5 mm, then more than 3.5 N/mm (``examples/fingertip.py``). All laws are for large strain: flesh
    turns with its finger, and a bone of a small-strain law would answer that rotation with enormous false reactions.

    Args:
        mesh_regions: Region names, e.g. ``hand.flesh``, ``hand.skin``, ``hand.bone``; others are left out.
            ``hand.skin:3/8`` is skin in three eighths of its volume, and flesh in the rest.
        flesh: Young's modulus at small strain of what lies between skin and bone [Pa].
        skin: The same of skin [Pa].
        joint: Young's modulus of what lies between the bones of a joint [Pa]: soft, since there it stands for
            cartilage that slides and skin that unfolds.
        bone: Young's modulus of bone [Pa].
        poisson: Poisson's ratio of flesh and skin.
        stiffening: Exponent β of Fung's law; 0 is neo-Hookean.

    Raises:
        InputError: A ratio that no flesh has.
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
        # it has to stiffen a little all the same: neo-Hookean flesh buckles in the crease of a joint beyond 60°
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
    """Two laws of a kind side by side, the second over a share of the volume: both are strained alike."""
    constants = {
        key: (1.0 - share) * getattr(one, key) + share * getattr(other, key)
        for key in ("c10", "c01", "bulk", "density", "stiffening")
    }
    return replace(other, **constants)
