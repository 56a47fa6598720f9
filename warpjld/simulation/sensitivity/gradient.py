"""Gradient of a solved frame with respect to P parameters, as arrays over parameters and nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, Response
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.sensitivity.effort_slope import DigitSlope, EffortTangent
from warpjld.simulation.sensitivity.parameters import JointAngle, Parameter, direction_of, perturbation_of
from warpjld.skeleton import Poses

__all__ = ["Gradient", "gradient_at"]

_FAR = 1e-7
"""Largest nodal displacement in the finite difference of tributary areas [m]."""


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of an equilibrium with respect to P parameters, per unit of each (rad, m, or 1).

    Attributes:
        parameters: The parameters.
        displacement: Derivatives of the displacements of all nodes [m], shape (P, N, 3).
        reactions: Derivatives of the reactions at prescribed nodes [N], shape (P, N, 3).
        contact_force: Derivatives of the contact forces on all nodes, friction included [N], shape (P, N, 3).
        pressure: Derivatives of the contact pressure at all nodes [Pa], shape (P, N).
    """

    parameters: tuple[Parameter, ...]
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    contact_force: NDArray[np.float64]
    pressure: NDArray[np.float64]
    _spans: Mapping[str, slice]
    _digits: Mapping[str, Sequence[Mapping[str, DigitSlope]]]

    def force(self, name: str) -> NDArray[np.float64]:
        """Derivative of the sum of the contact forces on a body [N], shape (P, 3).

        Raises:
            InputError: No deformable body of that name.
        """
        if name not in self._spans:
            raise InputError(f"name: nothing called {name} deforms here; there are {', '.join(self._spans)}")
        return np.asarray(self.contact_force[:, self._spans[name]].sum(axis=1))

    def digits(self, actor: str) -> dict[str, NDArray[np.float64]]:
        """Derivatives of ``bone_n`` of the table [N]: digit → shape (P,).

        Raises:
            InputError: No actor with flesh of that name.
        """
        rows = self._rows(actor)
        return {digit: np.array([row[digit].force for row in rows]) for digit in rows[0]}

    def torques(self, actor: str) -> dict[str, NDArray[np.float64]]:
        """Derivatives of the torques at base, knuckle 2 and knuckle 3 [N m]: digit → shape (P, 3).

        Raises:
            InputError: No actor with flesh of that name.
        """
        rows = self._rows(actor)
        return {digit: np.array([row[digit].torques for row in rows]) for digit in rows[0]}

    def _rows(self, actor: str) -> Sequence[Mapping[str, DigitSlope]]:
        if actor not in self._digits:
            raise InputError(f"actor: no flesh of '{actor}' here; there is that of {', '.join(self._digits) or 'none'}")
        return self._digits[actor]


def gradient_at(
    model: ContactModel,
    history: History,
    solution: ContactSolution,
    parameters: Sequence[Parameter],
    limits: Mapping[str, Mapping[str, float]] | None = None,
) -> Gradient:
    """Derivatives of the last equilibrium of a solution.

    Args:
        model: The contact model of the frame.
        history: History before the frame.
        solution: Solution of the frame.
        parameters: At least one parameter.
        limits: Force limits of digits that differ from the default [N], by actor and digit.

    Raises:
        InputError: A parameter of a joint, object or pair that is not in the model, or a solution read from a state
            file.
        SensitivityError: The equilibrium has no derivative.
    """
    if not parameters:
        raise InputError("parameters: want at least one")
    time, instant = solution.last.time, solution.last
    changes = [perturbation_of(model, history, time, one) for one in parameters]
    tangent = EquilibriumTangent(model.body, model.pairs, solution, model.prescribed(time, history).degrees)
    answers = [tangent.response(change) for change in changes]
    digits: dict[str, list[dict[str, DigitSlope]]] = {}
    contact = tangent.contact.sum(axis=0)
    for hand in model.hands:
        efforts = EffortTangent(model, hand, instant, contact, hand.bones.pose(time), (limits or {}).get(hand.name))
        digits[hand.name] = [
            efforts.slopes(answer, change, _posing(hand, parameter, time))
            for parameter, change, answer in zip(parameters, changes, answers, strict=True)
        ]
    return Gradient(
        tuple(parameters),
        np.stack([one.displacement for one in answers]),
        np.stack([one.reactions for one in answers]),
        np.stack([one.nodal.sum(axis=0) for one in answers]),
        np.stack([_pressure(model, tangent, solution, one) for one in answers]),
        dict(model.spans),
        digits,
    )


def _posing(hand: FleshBody, parameter: Parameter, time: float) -> Callable[[float], Poses] | None:
    """Pose of a hand as a function of the change of a parameter; None if the pose does not depend on it."""
    if not (isinstance(parameter, JointAngle) and parameter.actor == hand.name):
        return None
    angles, along = hand.bones.angles(time), direction_of(hand, parameter)
    return lambda by: hand.bones.posed(angles + by * along, time)


def _pressure(
    model: ContactModel, tangent: EquilibriumTangent, solution: ContactSolution, response: Response
) -> NDArray[np.float64]:
    """Derivative of the nodal pressure (normal force over tributary area) [Pa], shape (N,)."""
    x, du = model.body.mesh.nodes + solution.last.displacement, response.displacement
    step = _FAR / max(float(np.abs(du).max(initial=0.0)), _FAR)
    area = model.tributary_areas(x)
    wider = (model.tributary_areas(x + step * du) - model.tributary_areas(x - step * du)) / (2.0 * step)
    pushed = tangent.pushed.sum(axis=0)
    pushes = tangent.pushes(response).sum(axis=0)
    rate = pushes * area - pushed * wider
    return np.divide(rate, area**2, out=np.zeros(len(area)), where=area > 0.0)
