"""Distribution of an object's weight between a hand and a handle (R122, R123).

The handle is a central node of the object whose displacement along the axis of gravity is prescribed. Its reaction is
the weight it bears; the hand, or another body the object stands on, bears the rest.
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
        pairs: All contact pairs.
        holding: Indices of those between hand and object.
        gravity: Acceleration along one axis [m/s²].

    Attributes:
        weight: Weight of the object [N], above 0.
        handle: Index of the handle node.
        axis: Axis of gravity: 0, 1 or 2.
        tall: Extent of the object along it [m].

    Raises:
        InputError: Gravity not along one axis, or an object without weight.
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
        """Dirichlet condition of the handle: its displacement along the axis [m]."""
        return Prescribed(np.array([3 * self.handle + self.axis]), np.array([height]))

    def height(self, instant: ContactInstant) -> float:
        """Displacement of the handle along the axis [m]."""
        return float(instant.displacement[self.handle, self.axis])

    def lower(self, height: float, by: float) -> float:
        """Height reduced by a descent ``by`` [m] in the direction of gravity."""
        return height + self._down * by

    def sunk(self, since: float, height: float) -> float:
        """Descent from one height to another [m]."""
        return self._down * (height - since)

    def left(self, instant: ContactInstant) -> float:
        """Share of the weight borne by the handle."""
        return -self._down * float(instant.reactions[self.handle, self.axis]) / self.weight

    def elsewhere(self, instant: ContactInstant) -> float:
        """Share of the weight borne by other bodies than the hand."""
        others = (touch for k, touch in enumerate(instant.touches) if k not in self._holding)
        push = sum(float(touch.nodal[self._nodes, self.axis].sum()) for touch in others)
        return -self._down * push / self.weight

    def force(self, instant: ContactInstant) -> float:
        """Sum of the normal forces between hand and object [N]."""
        return sum(touch.normal_force for touch in self._touches(instant))

    def rate(self, tangent: EquilibriumTangent, change: Perturbation) -> float | None:
        """Logarithmic derivative of the normal force between hand and object with respect to a parameter; None without
        force.

        Raises:
            SensitivityError: The equilibrium has no derivative.
        """
        pushed = float(tangent.pushed[self._holding][:, self._nodes].sum())
        if not pushed > 0.0:
            return None
        return float(tangent.pushes(tangent.response(change))[self._holding][:, self._nodes].sum()) / pushed

    def relief(self, tangent: EquilibriumTangent) -> float:
        """Decrease of the share of the weight on the handle per descent [1/m].

        Raises:
            SensitivityError: The equilibrium has no derivative.
        """
        down = np.zeros(tangent.free.size)
        down[3 * self.handle + self.axis] = self._down
        follows = tangent.response(Perturbation(prescribed=down)).reactions[self.handle, self.axis]
        return self._down * float(follows) / self.weight

    def sliding(self, instant: ContactInstant) -> float:
        """Share of the contact area that slides, 0 … 1; NaN without contact."""
        touches = [touch for touch in self._touches(instant) if touch.contact_area > 0.0]
        area = sum(touch.contact_area for touch in touches)
        return sum(touch.sliding * touch.contact_area for touch in touches) / area if area > 0.0 else float("nan")

    def most(self, instant: ContactInstant) -> float:
        """Capacity: share of the weight that these pressures and their full friction could bear, both pointing up as
        far as the normals allow."""
        up = np.zeros(3)
        up[self.axis] = -self._down
        out = 0.0
        for touch, friction in zip(self._touches(instant), self._friction, strict=True):
            push = np.maximum(touch.pressure, 0.0) * touch.area
            # normals point outwards from the slave; the force on the slave points against them
            slant = np.clip(touch.normal @ up * np.where(self._mine[touch.nodes], -1.0, 1.0), -1.0, 1.0)
            out += float(push @ (slant + friction * np.sqrt(1.0 - slant**2)))
        return out / self.weight

    def used(self, instant: ContactInstant) -> float:
        """Mobilised friction: tangential force over μ times normal force, 0 … 1."""
        acts = allowed = 0.0
        for touch, friction in zip(self._touches(instant), self._friction, strict=True):
            along = np.einsum("mi,mi->m", touch.traction, touch.normal)
            across = np.linalg.norm(touch.traction - along[:, None] * touch.normal, axis=1)
            acts += float(touch.area @ across)
            allowed += friction * touch.normal_force
        return min(acts / allowed, 1.0) if allowed > 0.0 else 1.0

    def _touches(self, instant: ContactInstant) -> list[PairContact]:
        return [instant.touches[k] for k in self._holding]
