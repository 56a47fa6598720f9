"""An object that deforms, as contact takes it: what leads it, and what is prescribed of it (R92, R128)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Prescribed
from warpjld.grasp import Places
from warpjld.simulation.state_variables import Prescribing
from warpjld.simulation.bodies.support import Support
from warpjld.simulation.bodies.object_mesh import ObjectVolume

__all__ = ["ObjectBody"]


@dataclass(frozen=True, eq=False)
class ObjectBody:
    """An object that deforms.

    Attributes:
        volume: Its mesh at time 0.
        place: Where the script puts it at a time: one placement.
        states: What is prescribed, and the nodes it is prescribed for.
        start: Frame of time 0.
        support: What it stands on until a hand takes its weight.
        other: What is prescribed instead of all this, at a time.
    """

    volume: ObjectVolume
    place: Callable[[float], Places]
    states: Sequence[tuple[Prescribing, NDArray[np.int64]]]
    start: float
    support: Support | None = None
    other: Callable[[float], Prescribed] | None = None

    @property
    def name(self) -> str:
        """Of the object."""
        return self.volume.name

    def holds(self, state: Prescribing, time: float) -> bool:
        """Whether points go where the object goes."""
        stands = self.support is None or self.support.stands(time)
        return self.other is None and stands and state.holds(self.start + time)

    def guided(self, time: float) -> bool:
        """Whether something else than its states leads it."""
        if self.other is not None:
            return True
        return self.support is not None and not self.support.stands(time) and time < self.support.free

    def prescribed(self, time: float) -> Prescribed:
        """Displacements of its prescribed points (R128)."""
        if self.other is not None:
            return self.other(time)
        out = Prescribed(np.empty(0, np.int64), np.empty(0))
        if self.support is not None:
            out = self.support.prescribed(time)
        frame = self.start + time
        for state, nodes in self.states:
            moved = np.zeros((len(nodes), 3))
            axes = [k for k, axis in enumerate("xyz") if axis in state.tracks]
            held = self.holds(state, time)
            if held:
                axes = [0, 1, 2]
                moved = self.place(time).apply(self.volume.local[nodes])[0] - self.volume.mesh.nodes[nodes]
            begun = held
            for axis, track in state.tracks.items():
                begun = begun or frame >= track.keys[0].frame
                moved[:, "xyz".index(axis)] += float(track.spline(frame))
            if begun:
                degrees = (3 * nodes[:, None] + np.array(axes)).ravel()
                order = np.argsort(degrees)
                out = out + Prescribed(degrees[order], moved[:, axes].ravel()[order])
        return out
