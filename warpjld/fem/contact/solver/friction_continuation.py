"""Continuation in the friction coefficient, for bodies that are held by friction alone."""

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

__all__ = ["continue_in_friction"]

_FACTORS = (8.0, 2.0, 1.2, 1.0)
"""Factors on the friction coefficient, in the order of the continuation."""


def continue_in_friction(
    newton: ContactNewton,
    interfaces: Sequence[Interface],
    u: Array,
    states: list[ContactState],
    step: LoadStep,
    status: SolveStatus,
) -> tuple[SolveStatus, Equilibrium | None]:
    """Search for an equilibrium from those with larger friction, where more points stick.

    Halving the load step does not help there: a body on an incline remains the same problem, only smaller.

    Args:
        newton: The Newton solver.
        interfaces: Its interfaces; their friction is restored at the end.
        u, states: Displacement (3N,) and contact states at the start of the step.
        step: The load step.
        status: Status of the failed search, returned if this one fails as well.
    """
    pairs = [interface.pair for interface in interfaces]
    guess: tuple[Array, ...] = ()
    found: Equilibrium | None = None
    try:
        for factor in _FACTORS:
            for interface, pair in zip(interfaces, pairs, strict=True):
                interface.pair = replace(pair, friction=factor * pair.friction)
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
