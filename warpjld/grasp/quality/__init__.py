"""Grasp quality metrics, one per file, each with its formula and its source.

All but `penetration`, `self_penetration` and `contact_map` take plain arrays or a `Contacts` set, so that grasps from
other programs can be judged too. docs/explanation/metrics.md lists them and says how to add one.
"""

from warpjld.grasp.quality.closure import Closure, force_closure
from warpjld.grasp.quality.cone import friction_cone
from warpjld.grasp.quality.contact_map import ContactMap, contact_map
from warpjld.grasp.quality.contacts import Contacts, patch_spin
from warpjld.grasp.quality.diversity import Diversity, diversity
from warpjld.grasp.quality.gravity import SIX_DIRECTIONS, GravityResponse, gravity_displacement
from warpjld.grasp.quality.penetration import Penetration, penetration
from warpjld.grasp.quality.resistance import resisted_wrench
from warpjld.grasp.quality.self_penetration import self_penetration
from warpjld.grasp.quality.touch import ContactPatches, contact_patches, vertex_areas
from warpjld.grasp.quality.wrench_space import WrenchSpace, least_resistance, wrench_space
from warpjld.grasp.quality.wrenches import contact_wrenches, grasp_matrix

__all__ = [
    "SIX_DIRECTIONS",
    "Closure",
    "ContactMap",
    "ContactPatches",
    "Contacts",
    "Diversity",
    "GravityResponse",
    "Penetration",
    "WrenchSpace",
    "contact_map",
    "contact_patches",
    "contact_wrenches",
    "diversity",
    "force_closure",
    "friction_cone",
    "grasp_matrix",
    "gravity_displacement",
    "least_resistance",
    "patch_spin",
    "penetration",
    "resisted_wrench",
    "self_penetration",
    "vertex_areas",
    "wrench_space",
]
