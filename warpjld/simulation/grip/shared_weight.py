"""An object whose weight a hand and a handle share: what each of them bears (R122, R123).

The handle is one node in the object's middle whose height is prescribed and nothing else. What it bears is known from
its reaction; what is left of the weight, the hand bears, or something else that the object stands on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.contact import ContactInstant, Pair
from warpjld.fem.contact.results.contact_solution import PairContact
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.load.loads import volumes
from warpjld.fem.load.prescribed import Prescribed
from warpjld.simulation.bodies.support import handle_of

__all__ = ["SharedWeight"]


class SharedWeight:
    """An object, its weight, and the pairs by which a hand holds it.

    Args:
        body: Hand and object, merged.
        nodes: The object's nodes, shape (n,).
        pairs: All pairs of the contact problem.
        holding: Numbers of those between hand and object.
        gravity: Along one axis [m/s²].

    Attributes:
        weight: [N], above 0.
        handle: Node in the middle.
        axis: Of the weight, 0, 1 or 2.
        tall: Extent along it [m].

    Raises:
        InputError: Gravity along no axis or between axes, or an object without a weight.
    """

    def __init__(
        self,
        body: Body,
        nodes: NDArray[np.integer],
        pairs: Sequence[Pair],
        holding: Sequence[int],
        gravity: Sequence[float],
    ) -> None:
        pull = np.asarray(gravity, dtype=np.float64)
        if np.count_nonzero(pull) != 1 or not np.isfinite(pull).all():
            raise InputError(f"gravity: want a pull along one axis, got {pull.tolist()}")
        self._mine = np.zeros(len(body.mesh.nodes), dtype=bool)
        self._mine[nodes] = True
        self._nodes = np.flatnonzero(self._mine)
        own = self._mine[body.mesh.elements[:, 0]]
        mass = float(volumes(body.mesh)[own].sum(axis=1) @ np.broadcast_to(body.density, len(own))[own])
        self.axis = int(np.argmax(np.abs(pull)))
        self._down = float(np.sign(pull[self.axis]))
        self.weight = mass * float(np.abs(pull).max())
        if not self.weight > 0.0:
            raise InputError("the object weighs nothing: want a density above 0")
        x = body.mesh.nodes[self._nodes]
        self.handle = int(self._nodes[handle_of(x)])
        self.tall = float(np.ptp(x[:, self.axis]))
        self._holding = list(holding)
        self._friction = [pairs[k].friction for k in self._holding]

    def at(self, height: float) -> Prescribed:
        """The handle at a height: its displacement along the axis [m]."""
        return Prescribed(np.array([3 * self.handle + self.axis]), np.array([height]))

    def height(self, instant: ContactInstant) -> float:
        """Displacement of the handle along the axis [m]."""
        return float(instant.displacement[self.handle, self.axis])

    def lower(self, height: float, by: float) -> float:
        """A height that lies deeper by so much [m]."""
        return height + self._down * by

    def sunk(self, since: float, height: float) -> float:
        """How much deeper a height lies than another [m]."""
        return self._down * (height - since)

    def left(self, instant: ContactInstant) -> float:
        """Share of the weight that the handle bears."""
        return -self._down * float(instant.reactions[self.handle, self.axis]) / self.weight

    def elsewhere(self, instant: ContactInstant) -> float:
        """Share of the weight that other things than the hand bear."""
        others = (touch for k, touch in enumerate(instant.touches) if k not in self._holding)
        push = sum(float(touch.nodal[self._nodes, self.axis].sum()) for touch in others)
        return -self._down * push / self.weight

    def force(self, instant: ContactInstant) -> float:
        """Sum of the normal forces between hand and object [N]."""
        return sum(touch.normal_force for touch in self._touches(instant))

    def rate(self, tangent: EquilibriumTangent, change: Perturbation) -> float | None:
        """How fast the normal forces between hand and object grow with a parameter, as a share of them; None where
        there are none.

        Raises:
            SensitivityError: The equilibrium does not follow it.
        """
        pushed = float(tangent.pushed[self._holding][:, self._nodes].sum())
        if not pushed > 0.0:
            return None
        return float(tangent.pushes(tangent.response(change))[self._holding][:, self._nodes].sum()) / pushed

    def relief(self, tangent: EquilibriumTangent) -> float:
        """How much less of the weight the handle bears per metre that it goes down [1/m].

        Raises:
            SensitivityError: The equilibrium does not follow it.
        """
        down = np.zeros(tangent.free.size)
        down[3 * self.handle + self.axis] = self._down
        follows = tangent.response(Perturbation(prescribed=down)).reactions[self.handle, self.axis]
        return self._down * float(follows) / self.weight

    def sliding(self, instant: ContactInstant) -> float:
        """Share of the contact that slides, 0 … 1; NaN where nothing touches."""
        touches = [touch for touch in self._touches(instant) if touch.contact_area > 0.0]
        area = sum(touch.contact_area for touch in touches)
        return sum(touch.sliding * touch.contact_area for touch in touches) / area if area > 0.0 else float("nan")

    def most(self, instant: ContactInstant) -> float:
        """Share of the weight that friction and slant could bear with these pressures, were all of it to point up."""
        up = np.zeros(3)
        up[self.axis] = -self._down
        out = 0.0
        for touch, friction in zip(self._touches(instant), self._friction, strict=True):
            push = np.maximum(touch.pressure, 0.0) * touch.area
            # normals point away from the slave: what touches it pushes the other way
            slant = np.clip(touch.normal @ up * np.where(self._mine[touch.nodes], -1.0, 1.0), -1.0, 1.0)
            out += float(push @ (slant + friction * np.sqrt(1.0 - slant**2)))
        return out / self.weight

    def used(self, instant: ContactInstant) -> float:
        """Share of the friction that the pressures allow which acts, 0 … 1."""
        acts = allowed = 0.0
        for touch, friction in zip(self._touches(instant), self._friction, strict=True):
            along = np.einsum("mi,mi->m", touch.traction, touch.normal)
            across = np.linalg.norm(touch.traction - along[:, None] * touch.normal, axis=1)
            acts += float(touch.area @ across)
            allowed += friction * touch.normal_force
        return min(acts / allowed, 1.0) if allowed > 0.0 else 1.0

    def _touches(self, instant: ContactInstant) -> list[PairContact]:
        return [instant.touches[k] for k in self._holding]
