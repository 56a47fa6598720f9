"""Whether a hand holds an object's weight at a grip: its support is taken away, and what comes of it (R122–R124)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Prescribed, Status
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.hand.grip import Trial
from warpjld.press.detour import detour
from warpjld.press.object_body import ObjectBody
from warpjld.press.tighten import Tightening

__all__ = ["Lift", "Taken"]

_FADES = 3
"""Steps in which the forces of the points that an object stands on fade."""

_FIRST = 1e-4
"""First step down [m], and how much longer the next may be."""
_LONGER = 2.5
_LOWERINGS = 14
_FAR = 0.25
"""An object that sinks by this share of its height slides."""

_LEFT = 0.01
"""Share of the weight that may be left on the handle before it lets go."""

_HOPELESS = 0.95
"""A support that could be borne by this share at most is not taken away: it takes long to find that nothing holds."""

_PATIENCE = 1
"""Steps that may be halved while the support goes."""
_RETRIES = 3
"""Shorter steps down that are tried before an object is said to slide."""

_LET_GO = (Status.SLIDING, Status.UNHELD, Status.MAX_ITERATIONS)
_ALL = 1.0 - 1e-9


@dataclass(frozen=True, eq=False)
class Taken:
    """An object whose weight a hand has taken.

    Attributes:
        lowered: Displacement of its middle along the weight's axis [m].
        solution: The equilibrium that nothing but the hand holds.
    """

    lowered: float
    solution: ContactSolution


class Lift:
    """Grips tried on an object: the callable that ``gentlest_grip`` asks for.

    Args:
        tightening: The hand.
        one: The object, with its support.
        weight: Force on it [N], shape (3,).
    """

    def __init__(self, tightening: Tightening, one: ObjectBody, weight: NDArray[np.float64]) -> None:
        assert one.support is not None
        self._grips, self._one, self._support = tightening, one, one.support
        self._span = tightening.bodies.spans[one.name]
        self._weight = float(np.linalg.norm(weight))
        self._down = float(np.sign(weight[self._support.axis]))
        owners = tightening.bodies.owners
        self._pairs = [k for k, o in enumerate(owners) if {o.slave, o.master} == {one.name, tightening.hand.name}]
        self.taken: dict[float, Taken] = {}

    def __call__(self, grip: float) -> Trial | None:
        """What a grip does; None where contact could not be solved."""
        closed = self._grips.closed(grip)
        if not closed.converged:
            return None
        if not self._force(closed.last) > 0.0:
            return Trial(False, float("nan"), 0.0)
        if self._most(closed.last) < _HOPELESS * self._weight:
            return self._slides(grip, closed.last)
        bare = self._bared(grip, closed)
        if not bare.converged:
            return self._slides(grip, closed.last) if bare.status in _LET_GO else None
        if self._most(bare.last) < self._weight:
            return self._slides(grip, bare.last)
        lowest = self._lowered(grip, bare)
        if not lowest.converged:
            return self._slides(grip, bare.last) if lowest.status in _LET_GO else None
        held = self._bears(lowest.last) <= _LEFT * self._weight
        if held:
            let_go = self._let_go(grip, lowest)
            held = let_go.converged  # forces balance inside their friction cones
            if held:
                height = self._height(lowest.last) - self._height(closed.last)
                self.taken[grip] = Taken(height, let_go)
                lowest = let_go
        return self._trial(grip, lowest.last, held, self._sliding(lowest.last))

    def _slides(self, grip: float, instant: ContactInstant) -> Trial:
        return self._trial(grip, instant, False, 1.0)

    def _trial(self, grip: float, instant: ContactInstant, held: bool, sliding: float) -> Trial:
        effort = self._grips.effort(grip, instant)
        most = max(effort.digits, key=lambda digit: digit.share)
        return Trial(held, sliding, self._force(instant), most.share, most.digit)

    def _bared(self, grip: float, closed: ContactSolution) -> ContactSolution:
        """The points it stands on let go, all but the height of its middle."""
        there = self._degree(closed.last)
        own = closed.last.reactions[self._span]
        forces = np.zeros_like(closed.last.reactions)
        forces[self._span] = own
        return detour(
            self._grips.bodies,
            closed,
            _FADES,
            moves=self._grips.stays(grip),
            known=(self._one.name, lambda share: there),
            nodal=lambda share: (1.0 - share) * forces,
            patience=_PATIENCE,
        )

    def _lowered(self, grip: float, bare: ContactSolution) -> ContactSolution:
        """Its middle lowered until nothing is left on it, or everything slides."""
        now = bare
        left, step = self._bears(now.last), _FIRST
        first, failed = self._height(bare.last), 0
        far = _FAR * float(np.ptp(self._one.volume.mesh.nodes[:, self._support.axis]))
        for _ in range(_LOWERINGS):
            if abs(left) <= _LEFT * self._weight:
                break
            if left > 0.0 and (self._sliding(now.last) >= _ALL or abs(self._height(now.last) - first) > far):
                break
            height = self._height(now.last) + np.sign(left) * self._down * abs(step)
            ahead = self._moved(grip, now, height)
            if not ahead.converged:
                failed += 1
                if failed > _RETRIES:
                    return ahead
                step /= 3.0
                continue
            before, left = left, self._bears(ahead.last)
            now = ahead
            softness = step / (before - left) if abs(before - left) > 1e-9 * self._weight else np.inf
            wanted = abs(left * softness)
            step = min(wanted, _LONGER * abs(step), 0.25 * far)
        return now

    def _moved(self, grip: float, now: ContactSolution, height: float) -> ContactSolution:
        """Its middle at another height."""
        since = self._height(now.last)
        way = (self._one.name, lambda share: self._at(since + share * (height - since)))
        return detour(self._grips.bodies, now, 1, moves=self._grips.stays(grip), known=way, patience=0)

    def _let_go(self, grip: float, lowest: ContactSolution) -> ContactSolution:
        nothing = Prescribed(np.empty(0, np.int64), np.empty(0))
        way = (self._one.name, lambda share: nothing)
        return detour(self._grips.bodies, lowest, 1, moves=self._grips.stays(grip), known=way, patience=_PATIENCE)

    def _degree(self, instant: ContactInstant) -> Prescribed:
        return self._at(self._height(instant))

    def _at(self, height: float) -> Prescribed:
        return Prescribed(np.array([3 * self._support.handle + self._support.axis]), np.array([height]))

    def _height(self, instant: ContactInstant) -> float:
        return float(instant.displacement[self._span][self._support.handle, self._support.axis])

    def _bears(self, instant: ContactInstant) -> float:
        """What the handle still bears of the weight [N]."""
        return -self._down * float(instant.reactions[self._span][self._support.handle, self._support.axis])

    def _force(self, instant: ContactInstant) -> float:
        return sum(instant.touches[k].normal_force for k in self._pairs)

    def _most(self, instant: ContactInstant) -> float:
        """What friction and slant could bear of the weight at most with these pressures [N]."""
        out = 0.0
        up = np.zeros(3)
        up[self._support.axis] = -self._down
        bodies = self._grips.bodies
        for k in self._pairs:
            touch = instant.touches[k]
            push = np.maximum(touch.pressure, 0.0) * touch.area
            # normals point away from the slave: what touches it pushes the other way
            slant = touch.normal @ up * (-1.0 if bodies.owners[k].slave == self._one.name else 1.0)
            slant = np.clip(slant, -1.0, 1.0)
            out += float(push @ (slant + bodies.pairs[k].friction * np.sqrt(1.0 - slant**2)))
        return out

    def _sliding(self, instant: ContactInstant) -> float:
        touches = [instant.touches[k] for k in self._pairs if instant.touches[k].contact_area > 0.0]
        area = sum(touch.contact_area for touch in touches)
        return sum(touch.sliding * touch.contact_area for touch in touches) / area if area > 0.0 else float("nan")
