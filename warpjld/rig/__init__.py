"""A surface and its skeleton, as everything here takes them."""

from warpjld.rig.rig import Rig, Skin

__all__ = ["Rig", "Skin"]
