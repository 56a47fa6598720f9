"""Default joint limits: clinical ranges of motion (AAOS), and 20° for the metacarpals (A §9, R8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.actor_points import NO_ARTICULATION

__all__ = ["default_limits"]

# role: (flexion, pivot, twisting, abduction), each (smallest, largest) in degrees
_CLOSED = (0.0, 0.0)
_ROLES: dict[str, tuple[tuple[float, float], ...]] = {
    "wrist": ((-70, 80), (-30, 20), _CLOSED, (-30, 20)),
    "carpometacarpal": ((0, 20), _CLOSED, _CLOSED, _CLOSED),
    "base": ((-45, 90), (-20, 20), _CLOSED, (-20, 20)),
    "knuckle2": ((0, 100), _CLOSED, _CLOSED, _CLOSED),
    "knuckle3": ((0, 80), _CLOSED, _CLOSED, _CLOSED),
    "thumb.base": ((-20, 15), (-45, 45), _CLOSED, (-45, 45)),
    "thumb.knuckle2": ((0, 55), _CLOSED, _CLOSED, _CLOSED),
    "thumb.knuckle3": ((0, 80), _CLOSED, _CLOSED, _CLOSED),
    "tip": (_CLOSED,) * 4,  # an extremity has no bone
    "index.carpometacarpal": (_CLOSED,) * 4,
    "middle.carpometacarpal": (_CLOSED,) * 4,
    **dict.fromkeys(NO_ARTICULATION, (_CLOSED,) * 4),
    "forearm_twist": (_CLOSED, _CLOSED, (-80, 80), _CLOSED),
    "elbow": ((0, 150), _CLOSED, (-80, 80), _CLOSED),
    "shoulder": ((-60, 180), (0, 180), (-90, 70), (-60, 180)),
    "hip": ((-30, 120), (0, 45), (-45, 45), (-30, 45)),
    "knee": ((0, 135), _CLOSED, _CLOSED, _CLOSED),
    "ankle": ((-20, 50), _CLOSED, (-35, 35), _CLOSED),
}
# degrees, for joints with names of no known role
_OTHER = ((-120.0, 120.0), (-90.0, 90.0), (-120.0, 120.0), (-90.0, 90.0))


def default_limits(names: Sequence[str]) -> NDArray[np.float64]:
    """Limits [rad] of joints with these canonical names, shape (J, 4, 2); wide ones for names of no known role."""
    rows = []
    for name in names:
        parts = name.split(".")
        rows.append(_ROLES.get(".".join(parts[-2:])) or _ROLES.get(parts[-1]) or _OTHER)
    return np.radians(np.array(rows, dtype=np.float64))
