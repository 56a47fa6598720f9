"""What a simulation is differentiated by, and what each changes in its equations."""

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
"""Half of the difference of angles that bones' motions are differentiated with [rad]."""


@dataclass(frozen=True)
class JointAngle:
    """An angle of a joint at the frame, the frames before as they are [rad].

    Attributes:
        actor: Whose.
        joint: As ``index.base``, or ``left.index.base``.
        channel: One of ``CHANNELS``.
    """

    actor: str
    joint: str
    channel: str = "flexion"


@dataclass(frozen=True)
class ObjectPlace:
    """Place of an object at the frame, or of what is prescribed of it, the frames before as they are [m].

    Attributes:
        object: Name.
        axis: 0, 1 or 2.
    """

    object: str
    axis: int


@dataclass(frozen=True)
class Modulus:
    """All moduli of a body, or of one of its regions, as a share of what they are [1]: Poisson's ratio stays.

    Attributes:
        body: Actor or object.
        region: As the mesh names it; all regions where left out.
    """

    body: str
    region: str | None = None


@dataclass(frozen=True)
class Friction:
    """Coulomb's μ between two bodies [1]; it counts where they slide.

    Attributes:
        one, other: Actors or objects, in any order.
    """

    one: str
    other: str


Parameter = JointAngle | ObjectPlace | Modulus | Friction


def perturbation_of(model: ContactModel, history: History, time: float, parameter: Parameter) -> Perturbation:
    """What a parameter changes at a time.

    Raises:
        InputError: A parameter of nothing that is there, or of what is free.
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
    """The one angle, shape (J, 4).

    Raises:
        InputError: No such joint or channel, or bones that were not given by angles.
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
    """A hand's angles (J, 4) [rad] that change along a direction (J, 4)."""
    ends = [hand.bones.moves_of(angles + sign * _TURN * direction, time) for sign in (1.0, -1.0)]
    ahead, behind = (_held_at(hand, there, time) for there in ends)
    out = np.zeros(model.body.degrees)
    out[ahead.degrees + 3 * model.spans[hand.name].start] = (ahead.values - behind.values) / (2.0 * _TURN)
    return Perturbation(prescribed=out)


def _held_at(hand: FleshBody, moves: Moves, time: float) -> Prescribed:
    """What a hand's bones prescribe where they are elsewhere."""
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
    """Share by which each element's moduli grow, shape (E,)."""
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
