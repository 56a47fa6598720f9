"""What digits press with at an equilibrium, over what they may: muscles' limits, and a pressure (R118)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant
from warpjld.fem.hand.bone_loads import loads_from_contact
from warpjld.fem.hand.muscles import effort_of
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.bodies.skin_parts import digit_of_label
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame

__all__ = ["CRUSHING", "DigitLoad", "digit_loads", "peaks_of"]

CRUSHING = 1e6
"""Pressure on skin from which on flesh is crushed [Pa]: hardly any is left, and no law of it was measured there."""


@dataclass(frozen=True)
class DigitLoad:
    """One digit.

    Attributes:
        actor: Whose.
        digit: As the skeleton has it: ``left.index``, or ``index``.
        force: Sum of the contact forces on its bones [N].
        muscles: The largest share of the limits of its force and of its joints' torques.
        peak: Highest pressure on its skin [Pa].
    """

    actor: str
    digit: str
    force: float
    muscles: float
    peak: float

    def share(self, pressure: float) -> float:
        """What it does over what it may, where its skin may be pressed with ``pressure`` [Pa]."""
        return max(self.muscles, self.peak / pressure)

    def bound(self, pressure: float) -> str:
        """What ``share`` is about, in words."""
        if self.muscles >= self.peak / pressure:
            return "its muscles can do no more"
        return f"its skin is pressed with {1e-3 * pressure:.3g} kPa"


def digit_loads(
    model: ContactModel,
    hand: FleshBody,
    angles: NDArray[np.float64],
    instant: ContactInstant,
    limits: Mapping[str, float] | None,
) -> dict[str, DigitLoad]:
    """By digit. Contact forces are handed on to the bones by nearness: no equilibrium of the flesh alone is needed.

    Args:
        model: Everything.
        hand: Whose.
        angles: Joint angles there [rad], shape (J, 4).
        instant: The equilibrium.
        limits: Digit → largest force [N], where it is not the default.
    """
    span = model.spans[hand.name]
    nodal = sum((touch.nodal[span] for touch in instant.touches), np.zeros((span.stop - span.start, 3)))
    loads = loads_from_contact(hand.hand, instant.displacement[span], nodal)
    poses = hand.bones.posed(angles, instant.time)
    effort = effort_of(hand.bones.skeleton, poses, loads, limits=limits)
    peaks = peaks_of(model, hand, solved_frame(0.0, [instant]))
    out = {}
    for one in effort.digits:
        peak = peaks.get(one.digit.rpartition(".")[2], 0.0)
        out[one.digit] = DigitLoad(hand.name, one.digit, one.force, one.share, peak)
    return out


def peaks_of(model: ContactModel, hand: FleshBody, solved: SolvedFrame) -> dict[str, float]:
    """Highest pressure on the skin of each digit, and the palm's [Pa]."""
    labels = [digit_of_label(name) for name in hand.hand.label_names]
    digit_of = np.array([*labels, ""])[hand.hand.node_labels]  # "" for nodes inside
    pressure = solved.pressure(model)[model.spans[hand.name]]
    return {name: float(pressure[digit_of == name].max(initial=0.0)) for name in dict.fromkeys(labels)}
