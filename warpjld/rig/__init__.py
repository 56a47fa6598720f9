"""The rig: a surface, its skeleton and painted weights, the common input of all other packages."""

from warpjld.rig.rig import Rig, Skin

__all__ = ["Rig", "Skin"]
