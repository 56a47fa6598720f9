"""A hand as a deformable body: flesh driven by poses, limits of its muscles, and labels of its skin (B §3.3)."""

from warpjld.fem.hand.flesh_hand import FleshHand, build_flesh_hand
from warpjld.fem.hand.laws import hand_laws
from warpjld.fem.hand.motion import FleshMotion, motion_of

__all__ = ["FleshHand", "FleshMotion", "build_flesh_hand", "hand_laws", "motion_of"]
