"""Whether a grip holds an object against its weight, asked of the contact solver (R123, R124).

The grip closes without gravity, which keeps the object where the hand meets it. Then its weight comes on while a handle
in its middle keeps its height, and the handle is lowered until the hand bears all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.contact import ContactInstant, ContactSolution, Pair, press
from warpjld.simulation.grip.lower import Descent, descend
from warpjld.simulation.grip.search import Outcome, Trial
from warpjld.simulation.grip.shared_weight import Weighed
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed

__all__ = ["Holding"]

_HALVINGS = 2
"""Of the step in which the weight comes on; steps down are not halved: shorter ones are tried then."""


@dataclass(eq=False)
class Holding:
    """Grips tried on bodies in contact: the callable that ``gentlest_grip`` asks for.

    A grip closes in proportion to time from 0 to 1; the weight comes on at 2, and every step down takes one more.

    Attributes:
        body: Hand and object, merged.
        prescribed: Known displacements of a grip, whatever measures it: a way [m], an angle [rad], ….
        pairs: What holds the object, and nothing else.
        object: Name of its region.
        gravity: Along one axis [m/s²].
        loads: What else acts from the start, as the pressure inside an object.
        others: What else the object may touch: what they bear, the hand does not hold.
        opened: Grip from which all others close: nothing is displaced there.
        closing: Instants while a grip closes.
        guess: Grip before, grip, displacement (N, 3) → where to begin to look (N, 3).
        share: Largest share of the muscles' limits at an instant, and who has it.
        found: What the solver found for every grip tried: its instants from the first touch on.
        descents: How the object was lowered at every grip whose pressures could bear it.

    Raises:
        InputError: No pairs, no such object, or gravity along no axis.
    """

    body: Body
    prescribed: Callable[[float], Prescribed]
    pairs: Sequence[Pair]
    object: str
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    loads: Loads = field(default_factory=Loads)
    others: Sequence[Pair] = ()
    opened: float = 0.0
    closing: int = 1
    guess: Callable[[float, float, NDArray[np.float64]], NDArray[np.float64]] | None = None
    share: Callable[[ContactInstant], tuple[float, str]] | None = None
    found: dict[float, ContactSolution] = field(default_factory=dict)
    descents: dict[float, Descent] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.closing < 1:
            raise InputError(f"holding: want an instant or more while a grip closes, got {self.closing}")
        if not self.pairs:
            raise InputError("holding: want a pair that may hold the object")
        mesh = self.body.mesh
        if self.object not in mesh.region_names:
            raise InputError(f"holding: no region '{self.object}'; there are {', '.join(mesh.region_names)}")
        own = np.unique(mesh.elements[mesh.regions == mesh.region_names.index(self.object)])
        numbers = range(len(self.pairs))
        self.weighed = Weighed(self.body, own, [*self.pairs, *self.others], numbers, self.gravity)

    def __call__(self, grip: float) -> Trial:
        """What a grip does."""
        closed = self._press(
            lambda time: self._at(grip, time),
            lambda time: self.loads,
            [(k + 1) / self.closing for k in range(self.closing)],
            guess=None if self.guess is None else lambda before, time, u: self._first(grip, before, time, u),
        )
        self.found[grip] = closed
        if not closed.converged:
            return self._trial(Outcome.UNSOLVED, closed.last, float("nan"))
        if not self.weighed.force(closed.last) > 0.0:
            return self._trial(Outcome.APART, closed.last, 0.0)
        most = self.weighed.most(closed.last)
        if most < 1.0:
            return self._trial(Outcome.WEAK, closed.last, most)
        bare = self._lowered(grip, closed, self.weighed.height(closed.last), halvings=_HALVINGS)
        if not bare.converged:
            return self._trial(Outcome.UNSOLVED, closed.last, float("nan"))
        descent = descend(
            self.weighed,
            bare,
            lambda after, height: self._lowered(grip, after, height),
            lambda after: self._lowered(grip, after, None),
            foreseen=self._foreseen(grip),
        )
        self.descents[grip] = descent
        self.found[grip] = replace(descent.solution, instants=(*closed.instants, *bare.instants, *descent.instants))
        return self._trial(descent.outcome, descent.solution.last, descent.borne)

    def _at(self, grip: float, time: float) -> Prescribed:
        return self.prescribed(self.opened + min(time, 1.0) * (grip - self.opened))

    def _first(self, grip: float, before: float, time: float, u: NDArray[np.float64]) -> NDArray[np.float64]:
        assert self.guess is not None
        ways = [self.opened + share * (grip - self.opened) for share in (before, time)]
        return self.guess(ways[0], ways[1], u)

    def _lowered(
        self, grip: float, after: ContactSolution, height: float | None, *, halvings: int = 0
    ) -> ContactSolution:
        """The handle at another height under the whole weight, or without a handle."""
        begin, since = after.last.time, self.weighed.height(after.last)

        def known(time: float) -> Prescribed:
            held = self._at(grip, 1.0)
            return held if height is None else held + self.weighed.at(since + (time - begin) * (height - since))

        heavy = replace(self.loads, gravity=self.gravity)
        return self._press(known, lambda time: heavy, [begin + 1.0], after=after, halvings=halvings)

    def _press(
        self,
        known: Callable[[float], Prescribed],
        loads: Callable[[float], Loads],
        times: list[float],
        *,
        after: ContactSolution | None = None,
        guess: Callable[[float, float, NDArray[np.float64]], NDArray[np.float64]] | None = None,
        halvings: int | None = None,
    ) -> ContactSolution:
        return press(
            self.body,
            known,
            [*self.pairs, *self.others],
            loads,
            times=times,
            after=after,
            guess=guess,
            halvings=halvings,
            check=False,
        )

    def _foreseen(self, grip: float) -> float | None:
        """How far the object sank at the nearest grip that held it."""
        held = [one for one, descent in self.descents.items() if descent.outcome is Outcome.HELD]
        near = min(held, key=lambda one: abs(one - grip), default=None)
        return None if near is None else self.descents[near].sunk

    def _trial(self, outcome: Outcome, instant: ContactInstant, borne: float) -> Trial:
        force, sliding = self.weighed.force(instant), self.weighed.sliding(instant)
        share, who = self.share(instant) if self.share is not None and instant.touches else (0.0, "")
        return Trial(outcome, sliding, force, borne, share, who)
