"""Parameters by which a simulation is differentiated, and the perturbations they cause in its equations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact.sensitivity.perturbation import ObstacleTwist, Perturbation
from warpjld.fem.hand.blend import Moves
from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.skeleton.tree import CHANNELS

__all__ = ["Friction", "JointAngle", "Modulus", "ObjectPlace", "Parameter", "angles_perturbed", "perturbation_of"]

_TURN = 1e-5
"""Step of the central difference of bone motions by angles [rad]."""


@dataclass(frozen=True)
class JointAngle:
    """A joint angle at the frame, with earlier frames held constant [rad].

    Attributes:
        actor: Name of the actor.
        joint: Name of the joint, as ``index.base``, or ``left.index.base``.
        channel: One of ``CHANNELS``.
    """

    actor: str
    joint: str
    channel: str = "flexion"


@dataclass(frozen=True)
class ObjectPlace:
    """Position of an object, or of its prescribed points, at the frame, with earlier frames held constant [m].

    Attributes:
        object: Name of the object.
        axis: 0, 1 or 2.
    """

    object: str
    axis: int


@dataclass(frozen=True)
class Modulus:
    """Common factor on the moduli of a body or one of its regions [1]; Poisson's ratio is constant.

    Attributes:
        body: Name of the actor or object.
        region: Region of the mesh; None: all regions.
    """

    body: str
    region: str | None = None


@dataclass(frozen=True)
class Friction:
    """Coulomb's μ between two bodies [1]; it has an influence where they slide.

    Attributes:
        one, other: Names of actors or objects, in any order.
    """

    one: str
    other: str


Parameter = JointAngle | ObjectPlace | Modulus | Friction


def perturbation_of(model: ContactModel, history: History, time: float, parameter: Parameter) -> Perturbation:
    """Perturbation of the equations per unit of a parameter, at a time.

    Raises:
        InputError: A parameter of a joint, object or pair that is not in the model, or of a free object.
    """
    if isinstance(parameter, JointAngle):
        hand = _hand(model, parameter.actor)
        return angles_perturbed(model, hand, hand.bones.angles(time), time, direction_of(hand, parameter))
    if isinstance(parameter, ObjectPlace):
        return _placed(model, history, time, parameter)
    if isinstance(parameter, Modulus):
        return Perturbation(stiffness=_stiffer(model, parameter))
    names = {parameter.one, parameter.other}
    pairs = [k for k, owner in enumerate(model.owners) if {owner.slave, owner.master} == names]
    if not pairs:
        raise InputError(f"parameters: {parameter.one} and {parameter.other} are no pair that may touch")
    return Perturbation(friction=dict.fromkeys(pairs, 1.0))


def direction_of(hand: FleshBody, parameter: JointAngle) -> NDArray[np.float64]:
    """Unit direction of one joint angle, shape (J, 4).

    Raises:
        InputError: No such joint or channel, or a hand that is not driven by angles.
    """
    if not hand.bones.bendable:
        raise InputError(f"parameters: {parameter.actor} has poses, not angles")
    if parameter.channel not in CHANNELS:
        raise InputError(f"parameters: channel: want one of {', '.join(CHANNELS)}, got '{parameter.channel}'")
    out = np.zeros((len(hand.bones.skeleton), len(CHANNELS)))
    out[hand.bones.skeleton.index(parameter.joint), CHANNELS.index(parameter.channel)] = 1.0
    return out


def angles_perturbed(
    model: ContactModel,
    hand: FleshBody,
    angles: NDArray[np.float64],
    time: float,
    direction: NDArray[np.float64],
) -> Perturbation:
    """Perturbation of a hand's bones at angles (J, 4) [rad] that change along a direction (J, 4)."""
    ends = [hand.bones.moves_of(angles + sign * _TURN * direction, time) for sign in (1.0, -1.0)]
    ahead, behind = (_held_at(hand, there, time) for there in ends)
    out = np.zeros(model.body.degrees)
    out[ahead.degrees + 3 * model.spans[hand.name].start] = (ahead.values - behind.values) / (2.0 * _TURN)
    return Perturbation(prescribed=out)


def _held_at(hand: FleshBody, moves: Moves, time: float) -> Prescribed:
    """Dirichlet conditions of a hand whose bones have given motions."""
    return replace(hand, moves=lambda now: moves).prescribed(time)


def _hand(model: ContactModel, name: str) -> FleshBody:
    for hand in model.hands:
        if hand.name == name:
            return hand
    names = ", ".join(hand.name for hand in model.hands) or "none"
    raise InputError(f"parameters: no flesh of '{name}' here; there is that of {names}")


def _placed(model: ContactModel, history: History, time: float, parameter: ObjectPlace) -> Perturbation:
    name, axis = parameter.object, parameter.axis
    if axis not in (0, 1, 2):
        raise InputError(f"parameters: axis: want 0, 1 or 2, got {axis}")
    if name in model.obstacles:
        shift = np.eye(3)[axis]
        pairs = [k for k, owner in enumerate(model.owners) if owner.master == name]
        return Perturbation(obstacles={k: ObstacleTwist(shift) for k in pairs})
    if name not in {one.name for one in model.objects}:
        raise InputError(f"parameters: no object '{name}' here")
    span, known = model.spans[name], model.prescribed(time, history).degrees
    mine = known[(known >= 3 * span.start) & (known < 3 * span.stop) & (known % 3 == axis)]
    if not len(mine):
        raise InputError(f"parameters: {name} is free to move along {'xyz'[axis]}")
    out = np.zeros(model.body.degrees)
    out[mine] = 1.0
    return Perturbation(prescribed=out)


def _stiffer(model: ContactModel, parameter: Modulus) -> NDArray[np.float64]:
    """Relative change of each element's moduli per unit of the parameter, shape (E,)."""
    if parameter.body not in model.spans:
        raise InputError(
            f"parameters: nothing called {parameter.body} deforms here; there are {', '.join(model.spans)}"
        )
    mesh, span = model.body.mesh, model.spans[parameter.body]
    own = (mesh.elements[:, 0] >= span.start) & (mesh.elements[:, 0] < span.stop)
    if parameter.region is not None:
        if parameter.region not in mesh.region_names:
            raise InputError(f"parameters: no region '{parameter.region}'; there are {', '.join(mesh.region_names)}")
        own &= mesh.regions == mesh.region_names.index(parameter.region)
    return own.astype(np.float64)
