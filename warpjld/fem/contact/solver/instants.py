"""Results of a load step: the instant it reached, and its start as sensitivities need it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.results.contact_solution import ContactInstant, LastStep
from warpjld.fem.contact.results.touches import touch_of
from warpjld.fem.contact.solver.newton_state import Equilibrium

__all__ = ["instant_of", "last_step_of"]


def last_step_of(interfaces: Sequence[Interface], before: float, start: Array, found: Equilibrium) -> LastStep:
    """Start of the step to an equilibrium, at a time and displacement (3N,), with its slips and areas."""
    slips = [np.zeros((len(interface.edge), 3)) for interface in interfaces]
    areas = [np.zeros(len(interface.edge)) for interface in interfaces]
    for k, points in enumerate(found.points):
        slips[k][points.sites], areas[k][points.sites] = found.slips[k], points.area
    return LastStep(before, start.reshape(-1, 3), tuple(slips), tuple(areas))


def instant_of(
    nodes: Array,
    interfaces: Sequence[Interface],
    moduli: Sequence[Array],
    time: float,
    found: Equilibrium,
    solves: int,
    iterations: int,
    velocity: Array | None,
) -> ContactInstant:
    """An equilibrium at a time as an instant of a solution.

    Args:
        nodes: Rest positions of the bodies' nodes [m], shape (N, 3).
        interfaces: Contact interfaces.
        moduli: Contact modulus E* at each interface's slave nodes [Pa].
        time: The time.
        found: The equilibrium.
        solves, iterations: Linear solves since the previous instant, and iterations of these.
        velocity: Velocities with inertia [m/s], shape (3N,); None without.
    """
    x = nodes + found.displacement.reshape(-1, 3)
    touches = []
    for k, interface in enumerate(interfaces):
        points, tractions, slip = found.points[k], found.tractions[k], found.slips[k]
        touches.append(touch_of(interface, points, tractions, slip, found.states[k].bonded, moduli[k], x))
    shape = (-1, 3)
    return ContactInstant(
        time,
        found.displacement.reshape(shape),
        found.reactions.reshape(shape),
        tuple(touches),
        solves,
        iterations,
        found.residual,
        None if velocity is None else velocity.reshape(shape),
    )
