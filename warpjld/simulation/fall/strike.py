"""Strikes that may open a bond, among the contacts of a rigid step (R93, R102).

At rest, a contact closes by g h in a step of length h, the speed that gravity gives meanwhile, and a strike slower than
another g h cannot be told from it. A strike at speed v passes waves of stress ρ c v on (Johnson 1985, §11.1), with
c = √(E/ρ); bending waves in beams of rectangular section have √3 times that (Cremer, Heckl & Ungar 1973,
Structure-borne Sound, §II.3), and twice as much where they are reflected. Strikes whose waves stay below the strength
of every bond land rigidly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.simulation.fall.contact_points import RigidContact
from warpjld.simulation.fall.rigid_body import RigidBody
from warpjld.simulation.specification import BondStrength, ObjectMaterial

__all__ = ["Strike", "found_strikes", "impedance"]

_WAVES = 2.0 * 3.0**0.5
"""Largest stress of a strike over ρ c v: of a bending wave, reflected at an end."""


@dataclass(frozen=True)
class Strike:
    """A strike of bonded objects.

    Attributes:
        bodies: Indices of the bodies that it moves: those that strike, and those that press on them.
        on: Names of what they strike.
        speed: Speed of approach along the normal [m/s].
        wait: Time from the begin of the step to the first contact [s].
    """

    bodies: tuple[int, ...]
    on: tuple[str, ...]
    speed: float
    wait: float


def impedance(matter: ObjectMaterial) -> float:
    """ρ c = √(E ρ) of waves in a bar [Pa s/m]."""
    return float(np.sqrt(matter.young * matter.density))


def found_strikes(
    bodies: Sequence[RigidBody],
    pressed: Sequence[RigidContact],
    physical: Mapping[str, ObjectMaterial],
    bonds: Sequence[BondStrength],
    gravity: NDArray[np.float64],
    length: float,
) -> list[Strike]:
    """Strikes in a step of some length [s], among its contacts with an impulse.

    Args:
        bodies: All free bodies.
        pressed: The contacts.
        physical: Materials by name of object.
        bonds: Bonds that hold.
        gravity: Acceleration [m/s²], shape (3,).
        length: Length of the step [s].
    """
    rest = length * float(np.linalg.norm(gravity))
    weak = [_bearable(body, physical, bonds) for body in bodies]
    struck: dict[int, list[RigidContact]] = {}
    for c in pressed:
        for k in (c.body, c.other):
            if k >= 0 and c.closing - rest > max(rest, weak[k]):
                struck.setdefault(k, []).append(c)
    out: list[Strike] = []
    for k in struck:
        if any(k in strike.bodies for strike in out):
            continue
        group = _pressing(k, pressed)
        hits = [c for m in group for c in struck.get(m, [])]
        hardest = max(hits, key=lambda c: c.closing)
        own = {part.shape.name for part in bodies[k].parts}
        names = [c.name if c.own in own else c.own for c in hits]
        wait = min(max(c.gap, 0.0) / c.closing for c in hits)
        out.append(Strike(tuple(sorted(group)), tuple(dict.fromkeys(names)), hardest.closing, min(wait, length)))
    return out


def _bearable(body: RigidBody, physical: Mapping[str, ObjectMaterial], bonds: Sequence[BondStrength]) -> float:
    """Speed up to which a strike opens none of the bonds of a body [m/s]; infinite without bonds that can open."""
    names = {part.shape.name for part in body.parts}
    strength = min((min(b.normal, b.shear) for b in bonds if {b.one, b.other} <= names), default=np.inf)
    return strength / (_WAVES * max(impedance(physical[name]) for name in names))


def _pressing(first: int, pressed: Sequence[RigidContact]) -> set[int]:
    """Bodies connected to one by contacts with an impulse."""
    group, todo = {first}, [first]
    while todo:
        k = todo.pop()
        for c in pressed:
            for one, other in ((c.body, c.other), (c.other, c.body)):
                if one == k and other >= 0 and other not in group:
                    group.add(other)
                    todo.append(other)
    return group
