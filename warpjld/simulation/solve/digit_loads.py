"""Loads of digits at an equilibrium relative to their limits: muscles, skin pressure, balance of the grasp (R118)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant
from warpjld.fem.hand.bone_loads import loads_from_contact
from warpjld.fem.hand.muscles import effort_of
from warpjld.fem.hand.sideways import sideways_shares
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.grasp_balance import allowed_net
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame

__all__ = ["CRUSHING", "DigitLoad", "crushed", "digit_loads", "peaks_of"]

CRUSHING = 1e6
"""Pressure on skin above which its flesh counts as crushed [Pa]: laws of flesh were never measured there."""


@dataclass(frozen=True)
class DigitLoad:
    """Loads of one digit.

    Attributes:
        actor: Name of the actor.
        digit: Name in the skeleton: ``left.index``, or ``index``.
        force: Sum of the contact forces on its bones [N].
        muscles: Largest ratio of its force or joint torques to their limits.
        peak: Highest pressure on its skin [Pa].
        unopposed: Net force on a grasped object over the allowed one, if the digit pushes in its direction; else 0.
        pushed: Name of that object.
        sideways: Moment about its axis of abduction over what its muscles bear; positive where the load resists an
            increase of the abduction.
    """

    actor: str
    digit: str
    force: float
    muscles: float
    peak: float
    unopposed: float = 0.0
    pushed: str = ""
    sideways: float = 0.0

    def share(self, pressure: float, sideways: int = 0) -> float:
        """Largest ratio of load to limit, where ``pressure`` [Pa] is the limit of its skin.

        Args:
            pressure: [Pa].
            sideways: 0 for closing; 1 or -1 for abduction that increases or decreases: 0 if no load resists it.
        """
        if sideways:
            resisted = sideways * self.sideways
            return max(resisted, self.peak / pressure) if resisted > 0.0 else 0.0
        return max(self.muscles, self.peak / pressure, self.unopposed)

    def bound(self, pressure: float, sideways: int = 0) -> str:
        """Which limit determines ``share``, in words."""
        if sideways and sideways * self.sideways >= self.peak / pressure:
            return "the muscles that move it sideways can do no more"
        if not sideways and self.unopposed >= self.share(pressure):
            return f"nothing opposes it, it would push {self.pushed} away"
        if not sideways and self.muscles >= self.peak / pressure:
            return "its muscles can do no more"
        return f"its skin is pressed with {1e-3 * pressure:.3g} kPa"


def digit_loads(
    model: ContactModel,
    hand: FleshBody,
    angles: NDArray[np.float64],
    instant: ContactInstant,
    limits: Mapping[str, float] | None,
    weights: Mapping[str, float],
) -> dict[str, DigitLoad]:
    """Loads by digit; contact forces are assigned to the nearest bones, which needs no equilibrium of the flesh alone.

    Args:
        model: The contact model.
        hand: The hand.
        angles: Its joint angles at the equilibrium [rad], shape (J, 4).
        instant: The equilibrium.
        limits: Digit → force limit that differs from the default [N].
        weights: Assumed weights of objects that only hands hold, by name [N].
    """
    span = model.spans[hand.name]
    nodal = sum((touch.nodal[span] for touch in instant.touches), np.zeros((span.stop - span.start, 3)))
    loads = loads_from_contact(hand.hand, instant.displacement[span], nodal)
    poses = hand.bones.posed(angles, instant.time)
    effort = effort_of(hand.bones.skeleton, poses, loads, limits=limits)
    sideways = sideways_shares(hand.bones.skeleton, poses, loads, limits)
    pushes = _pushes(model, hand, instant, weights)
    peaks = peaks_of(model, hand, solved_frame(0.0, [instant]))
    out = {}
    for one in effort.digits:
        short = one.digit.rpartition(".")[2]
        pushed, share = pushes.get(short, ("", 0.0))
        most = one.share, peaks.get(short, 0.0), share, pushed, sideways[one.digit]
        out[one.digit] = DigitLoad(hand.name, one.digit, one.force, *most)
    return out


def _pushes(
    model: ContactModel, hand: FleshBody, instant: ContactInstant, weights: Mapping[str, float]
) -> dict[str, tuple[str, float]]:
    """By digit that pushes in the direction of the net force on an object: the object, and that force over the allowed
    one."""
    digit_of = hand.node_digits
    out: dict[str, tuple[str, float]] = {}
    for name, weight in weights.items():
        force = np.zeros_like(instant.displacement)
        for owner, touch in zip(model.owners, instant.touches, strict=False):
            if owner.master == name:
                force -= touch.nodal
        net, pressing = force.sum(axis=0), float(np.linalg.norm(force, axis=1).sum())
        share = float(np.linalg.norm(net)) / max(allowed_net(pressing, weight), 1e-300)
        mine = force[model.spans[hand.name]]
        for digit in dict.fromkeys(digit_of):
            if digit and mine[digit_of == digit].sum(axis=0) @ net > 0.0 and share > out.get(digit, ("", 0.0))[1]:
                out[digit] = (name, share)
    return out


def crushed(pressure: float) -> str:
    """Message about the highest pressure before no equilibrium was found [Pa]; empty if flesh bears it.

    Far beyond that, flesh between prescribed sides bulges and folds in many ways, and no solver follows it.
    """
    if pressure <= CRUSHING:
        return ""
    return f"before, {1e-6 * pressure:.2g} MPa were reached, which crush flesh: let the parts that press move less far"


def peaks_of(model: ContactModel, hand: FleshBody, solved: SolvedFrame) -> dict[str, float]:
    """Highest pressure on the skin of each digit and the palm [Pa]."""
    digit_of = hand.node_digits
    pressure = solved.pressure(model)[model.spans[hand.name]]
    return {name: float(pressure[digit_of == name].max(initial=0.0)) for name in dict.fromkeys(digit_of)}
