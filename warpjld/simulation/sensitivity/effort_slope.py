"""Derivatives of muscle efforts with respect to a parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Loads, SolveStatus
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.results.contact_solution import LastStep
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, Response
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.hand.alone import Untouched
from warpjld.fem.hand.bone_loads import BoneLoads, loads_from_contact, loads_from_reactions
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.skeleton import Poses

__all__ = ["DigitSlope", "EffortTangent"]

_FAR = 1e-6
"""Largest nodal displacement in the finite difference of efforts as a function of forces and positions [m]."""
_PART = 1e-4
"""Largest relative change of the reactions in that finite difference."""


@dataclass(frozen=True, eq=False)
class DigitSlope:
    """Derivatives of one digit's effort, per unit of a parameter.

    Attributes:
        force: Derivative of ``DigitEffort.force`` [N].
        load: Derivative of the resultant force on its phalanges [N], shape (3,).
        torques: Derivatives of the torques at base, knuckle 2 and knuckle 3 [N m], shape (3,).
        shares: Derivatives of force and torques over their limits, as ``DigitEffort.shares``, shape (4,).
    """

    force: float
    load: NDArray[np.float64]
    torques: NDArray[np.float64]
    shares: NDArray[np.float64]


class EffortTangent:
    """Efforts of a hand at an equilibrium, and their derivatives with respect to parameters.

    Args:
        model: The contact model.
        hand: The hand.
        instant: The equilibrium.
        contact: Contact forces on all nodes [N], shape (N, 3).
        poses: Pose of the hand.
        limits: Digit → force limit that differs from the default [N].
    """

    def __init__(
        self,
        model: ContactModel,
        hand: FleshBody,
        instant: ContactInstant,
        contact: NDArray[np.float64],
        poses: Poses,
        limits: Mapping[str, float] | None = None,
    ) -> None:
        self._model, self._hand, self._limits = model, hand, limits
        self._span = model.spans[hand.name]
        self._u, self._held = instant.displacement[self._span], instant.reactions[self._span]
        self._contact = contact[self._span]
        self._poses = poses
        loads = Loads(gravity=model.loads.gravity)
        self._alone = hand.alone.at(poses, self._u, self._held, self._contact, loads)
        self._tangent = None if self._alone is None else _untouched(hand, self._alone, loads)

    def slopes(
        self,
        response: Response,
        change: Perturbation,
        pose: Callable[[float], Poses] | None = None,
    ) -> dict[str, DigitSlope]:
        """Derivatives of the efforts of every digit, by central differences along the linear response.

        Args:
            response: Derivative of the equilibrium.
            change: Perturbation by the parameter.
            pose: Pose as a function of the change of the parameter; None if it is constant.
        """
        span = self._span
        du, held = response.displacement[span], response.reactions[span]
        pushed = response.nodal[:, span].sum(axis=0)
        alone = None if self._tangent is None else self._tangent.response(self._own(change))
        far = float(np.abs(du).max(initial=0.0))
        grown = float(np.abs(held).max(initial=0.0)) / max(float(np.abs(self._held).max(initial=0.0)), 1e-300)
        step = min(_FAR / max(far, 1e-300), _PART / max(grown, 1e-300), 1.0)
        ends = []
        for sign in (1.0, -1.0):
            by = sign * step
            poses = self._poses if pose is None else pose(by)
            ends.append(
                self._effort(poses, self._u + by * du, self._held + by * held, self._contact + by * pushed, alone, by)
            )
        return {
            a.digit: _slope(a.force - b.force, a.load - b.load, a.torques - b.torques, a.shares - b.shares, step)
            for a, b in zip(ends[0].digits, ends[1].digits, strict=True)
        }

    def _effort(
        self,
        poses: Poses,
        u: NDArray[np.float64],
        held: NDArray[np.float64],
        contact: NDArray[np.float64],
        alone: Response | None,
        by: float,
    ) -> Effort:
        flesh, loads = self._hand.hand, self._loads(u, held, contact)
        if self._alone is not None and alone is not None:
            own = self._alone
            loads = loads - loads_from_reactions(
                flesh, own.displacement + by * alone.displacement, own.reactions + by * alone.reactions
            )
        return effort_of(self._hand.bones.skeleton, poses, loads, limits=self._limits)

    def _loads(self, u: NDArray[np.float64], held: NDArray[np.float64], contact: NDArray[np.float64]) -> BoneLoads:
        if self._alone is None:
            return loads_from_contact(self._hand.hand, u, contact)
        return loads_from_reactions(self._hand.hand, u, held)

    def _own(self, change: Perturbation) -> Perturbation:
        """The part of a perturbation that concerns the hand's own mesh."""
        span, mesh = self._span, self._model.body.mesh
        known = None if change.prescribed is None else change.prescribed[3 * span.start : 3 * span.stop]
        first = mesh.elements[:, 0]
        mine = (first >= span.start) & (first < span.stop)
        return Perturbation(prescribed=known, stiffness=None if change.stiffness is None else change.stiffness[mine])


def _slope(
    force: float, load: NDArray[np.float64], torques: NDArray[np.float64], shares: NDArray[np.float64], step: float
) -> DigitSlope:
    both = 2.0 * step
    return DigitSlope(force / both, load / both, torques / both, shares / both)


def _untouched(hand: FleshBody, alone: Untouched, loads: Loads) -> EquilibriumTangent:
    """Tangent of the flesh without contact."""
    instant = ContactInstant(0.0, alone.displacement, alone.reactions, (), 0, 0, 0.0)
    last = LastStep(0.0, alone.displacement, (), ())
    found = ContactSolution(SolveStatus.CONVERGED, (instant,), "", (), (), loads, None, last)
    return EquilibriumTangent(hand.alone.body, [], found, hand.alone.degrees)
