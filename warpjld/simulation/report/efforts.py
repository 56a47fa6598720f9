"""What contact puts on the bones of a hand and on its muscles, from an equilibrium (B eq. 8, R118).

Bones are held by reactions. Less those that hold the same hand in the same pose when nothing touches it
(``FleshBody.alone``), they are what contact asks of the muscles. Contact of the hand's own skin, of two fingers, counts
as contact: muscles press them together.

Contact forces handed on to the bones by nearness (``loads_from_contact``) are near, and are what is left where the
flesh alone finds no equilibrium. In ``examples/press_ball.jld`` they differ by less than 0.7 % in a digit's force,
0.3 % in the torque about its base, 7 % about knuckle 2 and 3 to 7 % about knuckle 3, there a third at the thumb and
the pinky, which are pressed beside that joint; for a fingertip on a plate by less than 0.01 %, 0.01 %, 0.1 % and 4 %;
for a force beside the root of a finger, which finger and palm share, by 10 % in force and 17 % in torque. Reactions
with what flesh alone takes would be off by 0.15 N a finger in that example, and by 5 N at the thumb of a hand whose
flesh is at rest when it is flat.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads
from warpjld.fem.contact import ContactInstant
from warpjld.fem.hand.bone_loads import loads_from_contact, loads_from_reactions
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.skeleton import Poses

__all__ = ["effort_at"]


def effort_at(
    model: ContactModel,
    hand: FleshBody,
    poses: Poses,
    found: SolvedFrame | ContactInstant,
    limits: Mapping[str, float] | None = None,
) -> Effort:
    """Compare what contact puts on the bones with what muscles can do.

    Where the flesh alone finds no equilibrium, contact forces are handed on to the bones by nearness instead, and the
    digits' ``flesh`` is NaN.

    Args:
        model: Everything.
        hand: Whose.
        poses: One pose of it.
        found: The equilibrium in that pose.
        limits: Digit → largest force [N], where it is not the default.
    """
    span = model.spans[hand.name]
    u, reactions, contact = found.displacement[span], found.reactions[span], _contact(found, span)
    alone = hand.alone.at(poses, u, reactions, contact, Loads(gravity=model.loads.gravity))
    if alone is None:
        return effort_of(hand.bones.skeleton, poses, loads_from_contact(hand.hand, u, contact), limits=limits)
    own = loads_from_reactions(hand.hand, alone.displacement, alone.reactions)
    loads = loads_from_reactions(hand.hand, u, reactions) - own
    return effort_of(hand.bones.skeleton, poses, loads, limits=limits, flesh=own)


def _contact(found: SolvedFrame | ContactInstant, span: slice) -> NDArray[np.float64]:
    """Contact forces on some of the nodes, all pairs together [N], shape (n, 3)."""
    nodal = found.nodal if isinstance(found, SolvedFrame) else [touch.nodal for touch in found.touches]
    return sum((one[span] for one in nodal), np.zeros((span.stop - span.start, 3)))
