"""Equilibria of bodies that friction alone holds, by way of those of rougher surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.solver.contact_newton import ContactNewton
from warpjld.fem.contact.solver.contact_system import LoadStep
from warpjld.fem.contact.solver.newton_state import Equilibrium
from warpjld.fem.solver.krylov import SolveStatus

__all__ = ["from_rougher"]

_ROUGHER = (8.0, 2.0, 1.2, 1.0)
"""Friction over what it is, of equilibria that lead to one that is hard to find."""


def from_rougher(
    newton: ContactNewton,
    interfaces: Sequence[Interface],
    u: Array,
    states: list[ContactState],
    step: LoadStep,
    status: SolveStatus,
) -> tuple[SolveStatus, Equilibrium | None]:
    """An equilibrium looked for from that of rougher surfaces, where all sticks that can: halving a step of a body on
    an incline only makes the same problem smaller.

    Args:
        newton, interfaces: That look for it; their friction is as before in the end.
        u, states: Displacement (3N,) and contact where the step begins.
        step: The step.
        status: Why none was found, which stays where none is found this way.
    """
    pairs = [interface.pair for interface in interfaces]
    guess: tuple[Array, ...] = ()
    found: Equilibrium | None = None
    try:
        for rougher in _ROUGHER:
            for interface, pair in zip(interfaces, pairs, strict=True):
                interface.pair = replace(pair, friction=rougher * pair.friction)
            failure = newton.failure
            found = newton.find(u, states, step, *guess)[1]
            if found is None:
                newton.failure = failure
                return status, None
            states, guess = found.states, (found.displacement,)
    finally:
        for interface, pair in zip(interfaces, pairs, strict=True):
            interface.pair = pair
    return SolveStatus.CONVERGED, found
