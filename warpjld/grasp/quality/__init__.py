"""How good a grasp is. One measure a file, each with its formula and its source.

All but `penetration` take plain arrays or a `Contacts` set, so that grasps from elsewhere can be judged too.
"""

from warpjld.grasp.quality.closure import Closure, force_closure
from warpjld.grasp.quality.cone import friction_cone
from warpjld.grasp.quality.contacts import Contacts, patch_spin
from warpjld.grasp.quality.gravity import SIX_DIRECTIONS, GravityResponse, gravity_displacement
from warpjld.grasp.quality.penetration import Penetration, penetration
from warpjld.grasp.quality.resistance import resisted_wrench
from warpjld.grasp.quality.touch import ContactPatches, contact_patches, vertex_areas
from warpjld.grasp.quality.wrench_space import WrenchSpace, least_resistance, wrench_space
from warpjld.grasp.quality.wrenches import contact_wrenches, grasp_matrix

__all__ = [
    "SIX_DIRECTIONS",
    "Closure",
    "ContactPatches",
    "Contacts",
    "GravityResponse",
    "Penetration",
    "WrenchSpace",
    "contact_patches",
    "contact_wrenches",
    "force_closure",
    "friction_cone",
    "grasp_matrix",
    "gravity_displacement",
    "least_resistance",
    "patch_spin",
    "penetration",
    "resisted_wrench",
    "vertex_areas",
    "wrench_space",
]
