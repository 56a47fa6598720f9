"""Loads on the bones of a hand and efforts of its muscles due to contact, from an equilibrium (B eq. 8, R118).

The load of contact is the reactions at the bones minus those of the same hand in the same pose without contact
(``FleshBody.alone``). Self-contact, as of two fingers, counts as contact: muscles press them together.

If the flesh alone has no equilibrium in the pose, contact forces are assigned to the nearest bones instead
(``loads_from_contact``). In ``examples/press_ball.jld`` that differs by less than 0.7 % in a digit's force, 0.3 % in
the torque about its base, 7 % about knuckle 2 and 3 to 7 % about knuckle 3, there by a third at the thumb and the
pinky, which are pressed beside that joint; for a fingertip on a plate by less than 0.01 %, 0.01 %, 0.1 % and 4 %; for a
force beside the root of a finger, which finger and palm share, by 10 % in force and 17 % in torque. Reactions without
subtracting those of the flesh alone would be wrong by 0.15 N per finger in that example, and by 5 N at the thumb of a
hand whose flesh is stress-free when flat.
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
    """Efforts of a hand's muscles due to contact, relative to their limits.

    If the flesh alone has no equilibrium, contact forces are assigned to the nearest bones, and the digits' ``flesh``
    is NaN.

    Args:
        model: The contact model.
        hand: The hand.
        poses: Its pose (a batch of one).
        found: Equilibrium in that pose.
        limits: Digit → force limit that differs from the default [N].
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
    """Contact forces on the nodes of a span, summed over pairs [N], shape (n, 3)."""
    nodal = found.nodal if isinstance(found, SolvedFrame) else [touch.nodal for touch in found.touches]
    return sum((one[span] for one in nodal), np.zeros((span.stop - span.start, 3)))
