"""Derivatives of each digit's force with respect to its own joints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import SensitivityError
from warpjld.fem.hand.suggestions import DigitSlopes
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.sensitivity.gradient import gradient_at
from warpjld.simulation.sensitivity.parameters import JointAngle

__all__ = ["joint_slopes"]

_JOINTS = ("base", "knuckle2", "knuckle3")
"""Joints of a digit, proximal to distal."""


def joint_slopes(
    model: ContactModel, history: History, solution: ContactSolution, actor: str, forces: Mapping[str, float]
) -> dict[str, DigitSlopes] | None:
    """Derivatives by digit at the last equilibrium of a solution; None if it has no derivative.

    Args:
        model: The contact model of the frame.
        history: History before the frame.
        solution: Solution of the frame.
        actor: Name of the actor; it has to be driven by joint angles.
        forces: Forces at the equilibrium of the digits to evaluate [N].
    """
    parameters = [JointAngle(actor, f"{digit}.{joint}") for digit in forces for joint in _JOINTS]
    try:
        found = gradient_at(model, history, solution, parameters).digits(actor)
    except SensitivityError:
        return None
    return {
        digit: DigitSlopes(forces[digit], np.asarray(found[digit][3 * k : 3 * k + 3])) for k, digit in enumerate(forces)
    }
