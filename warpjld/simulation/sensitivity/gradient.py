"""The gradient of a solved frame: everything that follows the parameters, as arrays (P parameters, N nodes)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.results.nodal_contact import tributary_areas
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, Response
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.sensitivity.effort_slope import DigitSlope, EffortTangent
from warpjld.simulation.sensitivity.parameters import JointAngle, Parameter, direction_of, perturbation_of
from warpjld.skeleton import Poses

__all__ = ["Gradient", "gradient_at"]

_FAR = 1e-7
"""Way of the node that moves most in differences of areas [m]."""


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of an equilibrium by P parameters, each per unit of it (rad, m, or 1).

    Attributes:
        parameters: Those.
        displacement: Of all nodes [m], shape (P, N, 3).
        reactions: Of the forces that hold prescribed nodes [N], shape (P, N, 3).
        contact_force: Of the contact forces on all nodes, friction included [N], shape (P, N, 3).
        pressure: Of the contact pressure at all nodes [Pa], shape (P, N).
    """

    parameters: tuple[Parameter, ...]
    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    contact_force: NDArray[np.float64]
    pressure: NDArray[np.float64]
    _spans: Mapping[str, slice]
    _digits: Mapping[str, Sequence[Mapping[str, DigitSlope]]]

    def force(self, name: str) -> NDArray[np.float64]:
        """Of the sum of the contact forces on a body [N], shape (P, 3).

        Raises:
            InputError: No such body.
        """
        if name not in self._spans:
            raise InputError(f"name: nothing called {name} deforms here; there are {', '.join(self._spans)}")
        return np.asarray(self.contact_force[:, self._spans[name]].sum(axis=1))

    def digits(self, actor: str) -> dict[str, NDArray[np.float64]]:
        """Of the force of each digit's bones, ``bone_n`` in the table [N]: digit → shape (P,).

        Raises:
            InputError: No such actor.
        """
        rows = self._rows(actor)
        return {digit: np.array([row[digit].force for row in rows]) for digit in rows[0]}

    def torques(self, actor: str) -> dict[str, NDArray[np.float64]]:
        """Of the torques of base, knuckle 2 and knuckle 3 [N m]: digit → shape (P, 3).

        Raises:
            InputError: No such actor.
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
        model: Everything, as it was solved.
        history: What was known before.
        solution: Of the frame.
        parameters: At least one.
        limits: Largest forces of digits [N], by actor and digit, where they are not the default.

    Raises:
        InputError: Parameters of nothing that is there, or a solution that was read from a state.
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
    """A hand's pose at a change of a parameter; None where it stays."""
    if not (isinstance(parameter, JointAngle) and parameter.actor == hand.name):
        return None
    angles, along = hand.bones.angles(time), direction_of(hand, parameter)
    return lambda by: hand.bones.posed(angles + by * along, time)


def _pressure(
    model: ContactModel, tangent: EquilibriumTangent, solution: ContactSolution, response: Response
) -> NDArray[np.float64]:
    """Of what presses on a node over the area around it [Pa], shape (N,)."""
    mesh, u, du = model.body.mesh, solution.last.displacement, response.displacement
    step = _FAR / max(float(np.abs(du).max(initial=0.0)), _FAR)

    def areas(by: float) -> NDArray[np.float64]:
        x = mesh.nodes + u + by * du
        return sum((tributary_areas(mesh, one.faces, x) for one in model.bodies), np.zeros(len(x)))

    area, wider = areas(0.0), (areas(step) - areas(-step)) / (2.0 * step)
    pushed = tangent.pushed.sum(axis=0)
    pushes = tangent.pushes(response).sum(axis=0)
    rate = pushes * area - pushed * wider
    return np.divide(rate, area**2, out=np.zeros(len(area)), where=area > 0.0)
