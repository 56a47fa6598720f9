"""Default constitutive laws of a hand's regions (R101, R109)."""

from __future__ import annotations

from warpjld.errors import InputError
from warpjld.fem.materials import Material, NeoHooke

__all__ = ["hand_laws"]

_POISSON = (0.3, 0.49)


def hand_laws(
    mesh_regions: tuple[str, ...],
    *,
    flesh: float = 34e3,
    skin: float = 80e3,
    bone: float = 17e9,
    poisson: float = 0.48,
) -> dict[str, Material]:
    """A law for every region of a hand's mesh, by the last part of its name.

    Moduli after Maeno et al. 1998, quoted from memory: subcutaneous fat 34 kPa, dermis 80 kPa (epidermis 136 kPa),
    ν = 0.48; bone 17 GPa. All laws are for large strain: flesh turns with its finger, and a bone of a small-strain law
    would answer that rotation with enormous false reactions.

    Args:
        mesh_regions: Region names, e.g. ``hand.flesh``, ``hand.skin``, ``hand.bone``; others are left out.
        flesh: Young's modulus of what lies between skin and bone [Pa].
        skin: Young's modulus of the outermost layer of elements [Pa].
        bone: Young's modulus of bone [Pa].
        poisson: Poisson's ratio of flesh and skin.

    Raises:
        InputError: A ratio that no flesh has.
    """
    if not _POISSON[0] <= poisson <= _POISSON[1]:
        raise InputError(f"poisson: want {_POISSON[0]}…{_POISSON[1]} for flesh, got {poisson}")
    made = {
        "flesh": NeoHooke(flesh, poisson, 1050.0),
        "skin": NeoHooke(skin, poisson, 1100.0),
        "bone": NeoHooke(bone, 0.3, 1900.0),
    }
    return {name: made[kind] for name in mesh_regions if (kind := name.rpartition(".")[2]) in made}
