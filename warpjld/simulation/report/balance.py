"""Force and moment balance of objects: the resultant of all contact forces, zero for a balanced grasp (R112)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.grasp_balance import allowed_net, weight_of
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["ObjectBalance", "balances"]

_OPPOSED = 0.1
"""Share of the contact forces that has to be opposed for an object to count as grasped rather than pushed."""
_SLIGHT = 0.1
"""Forces below this are not reported [N]."""

_LIES = 0.01
"""Share of a free object's weight that may be left over where the forces on it bear it; equilibria are found to 1e-4 of
all forces, those of other bodies included."""


@dataclass(frozen=True, eq=False)
class ObjectBalance:
    """Contact forces on one object at one frame.

    Attributes:
        object: Name of the object.
        frame: Frame number.
        force: Resultant [N], shape (3,); with its weight if the object is lifted.
        moment: Resultant moment about the force-weighted centre [N m], shape (3,).
        pressing: Sum of the magnitudes of the nodal forces [N].
        by_hands: Whether only hands touch it, and no HOLD or support constrains it. Not so for one that was lifted: the
            gentlest grip may slide at every point, and be in balance all the same.
        weight: Assumed weight of a rigid object [N]; 0 for a deformable one.
        borne: Whether something else balances a resultant: its animation, HOLD, a support, or gravity.
        lies: Whether nothing else holds it, and the forces bear its weight.
    """

    object: str
    frame: float
    force: NDArray[np.float64]
    moment: NDArray[np.float64]
    pressing: float
    by_hands: bool
    weight: float
    borne: bool
    lies: bool = False

    @property
    def net(self) -> float:
        """Magnitude of the resultant [N]."""
        return float(np.linalg.norm(self.force))

    @property
    def grasped(self) -> bool:
        """Whether hands alone press on it, from several sides."""
        return self.by_hands and self.pressing > _SLIGHT and self.net < (1.0 - _OPPOSED) * self.pressing

    @property
    def unbalanced(self) -> bool:
        """Whether it is grasped, and the resultant exceeds the allowed one, and is not its weight."""
        return self.grasped and not self.lies and self.net > max(allowed_net(self.pressing, self.weight), _SLIGHT)

    @property
    def text(self) -> str:
        """``on BOX 61 N press, of which 38 N and 0.4 N m are left over: what holds BOX in its place bears them``."""
        turn = float(np.linalg.norm(self.moment))
        out = f"on {self.object} {self.pressing:.3g} N press"
        if not self.borne or self.net < _SLIGHT:
            return f"{out}, and balance"
        if self.lies:
            return f"{out}, and bear its weight"
        bears = f"what holds {self.object} in its place bears them"
        return f"{out}, of which {self.net:.3g} N and {turn:.2g} N m are left over: {bears}"


def balances(model: ContactModel, solved: SolvedFrame) -> list[ObjectBalance]:
    """Balance of every object in contact at a frame."""
    hands = {hand.name for hand in model.hands}
    bodies = {one.name: one for one in model.objects}
    x = model.body.mesh.nodes + solved.displacement
    out = []
    for name in (*bodies, *model.obstacles):
        forces = np.zeros_like(x)
        others = set()
        for owner, nodal in zip(model.owners, solved.nodal, strict=True):
            other = owner.other(name)
            if other is None or not nodal.any():
                continue
            others.add(other)
            # forces on an obstacle are the reactions to those on the nodes
            forces += _nodal_on(model, name, nodal) if name in bodies else -nodal
        size = np.linalg.norm(forces, axis=1)
        pressing = float(size.sum())
        if pressing == 0.0:
            continue
        force = forces.sum(axis=0)
        centre = size @ x / pressing
        moment = np.cross(x - centre, forces).sum(axis=0)
        one = bodies.get(name)
        support = None if one is None else one.support
        lifted = support is not None and solved.frame - model.start >= support.free - 1e-9
        kept = one is not None and (bool(one.states) or support is not None)
        borne = one is None or kept or any(model.loads.gravity)
        pull = np.zeros(3) if one is None else model.pull(name).sum(axis=0)
        left = float(np.linalg.norm(force + pull))
        lies = one is not None and not kept and left <= _LIES * float(np.linalg.norm(pull))
        if lifted:  # its weight is what the hand bears
            force = force + pull
        weight = weight_of(model.obstacles[name], solved.frame - model.start) if one is None else 0.0
        out.append(
            ObjectBalance(
                name, solved.frame, force, moment, pressing, others <= hands and not kept, weight, borne, lies
            )
        )
    return out


def _nodal_on(model: ContactModel, name: str, nodal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Forces (N, 3) on the nodes of one body, zero elsewhere."""
    out = np.zeros_like(nodal)
    out[model.spans[name]] = nodal[model.spans[name]]
    return out
