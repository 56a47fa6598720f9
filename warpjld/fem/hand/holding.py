"""Whether a grip holds an object against its weight, asked of the contact solver (R123, R124).

The grip closes without gravity, which keeps the object where the hand meets it; then the weight comes on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.body import Body
from warpjld.fem.conjugate import Status
from warpjld.fem.contact import ContactInstant, ContactSolution, Pair, press
from warpjld.fem.hand.grip import Trial
from warpjld.fem.loads import Loads
from warpjld.fem.prescribed import Prescribed

__all__ = ["Holding"]

_LET_GO = (Status.SLIDING, Status.UNHELD)


@dataclass(eq=False)
class Holding:
    """Grips tried on bodies in contact: the callable that ``gentlest_grip`` asks for.

    A grip closes in proportion to time from 0 to 1; from 1 to 2 the weight comes on in proportion.

    Attributes:
        body: Hand and object, merged.
        prescribed: Known displacements of a grip, whatever measures it: a way [m], an angle [rad], ….
        pairs: What holds the object, and nothing else.
        gravity: [m/s²].
        loads: What else acts from the start, as the pressure inside an object.
        opened: Grip from which all others close: nothing is displaced there.
        closing: Instants while a grip closes.
        weighing: Instants while the weight comes on.
        guess: Grip before, grip, displacement (N, 3) → where to begin to look (N, 3).
        share: Largest share of the muscles' limits at an instant, and who has it.
        found: What the solver found for every grip tried.
    """

    body: Body
    prescribed: Callable[[float], Prescribed]
    pairs: Sequence[Pair]
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    loads: Loads = field(default_factory=Loads)
    opened: float = 0.0
    closing: int = 1
    weighing: int = 2
    guess: Callable[[float, float, NDArray[np.float64]], NDArray[np.float64]] | None = None
    share: Callable[[ContactInstant], tuple[float, str]] | None = None
    found: dict[float, ContactSolution] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if min(self.closing, self.weighing) < 1:
            raise InputError(f"holding: want an instant or more each, got {self.closing} and {self.weighing}")
        if not self.pairs:
            raise InputError("holding: want a pair that may hold the object")

    def __call__(self, grip: float) -> Trial | None:
        """What a grip does; None where the solver failed for another reason than that the object slides or falls."""
        ways = np.arange(1, self.closing + 1) / self.closing
        weights = 1.0 + np.arange(1, self.weighing + 1) / self.weighing

        def at(time: float) -> float:
            return self.opened + min(time, 1.0) * (grip - self.opened)

        def loads(time: float) -> Loads:
            x, y, z = (max(time - 1.0, 0.0) * part for part in self.gravity)
            return replace(self.loads, gravity=(x, y, z))

        def first(before: float, time: float, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
            assert self.guess is not None
            return self.guess(at(before), at(time), displacement)

        solution = press(
            self.body,
            lambda time: self.prescribed(at(time)),
            self.pairs,
            loads,
            times=[*ways, *weights],
            guess=first if self.guess is not None else None,
            check=False,
        )
        self.found[grip] = solution
        if not solution.converged and solution.status not in _LET_GO:
            return None
        return self._trial(solution)

    def _trial(self, solution: ContactSolution) -> Trial:
        last = solution.last
        force = sum(touch.normal_force for touch in last.touches)
        area = sum(touch.contact_area for touch in last.touches)
        slides = sum(touch.sliding * touch.contact_area for touch in last.touches if touch.contact_area > 0.0)
        sliding = float("nan") if not area > 0.0 else slides / area if solution.converged else 1.0
        share, who = self.share(last) if self.share is not None and last.touches else (0.0, "")
        # forces that balance inside their friction cones hold, even where every point is at its cone's border
        return Trial(solution.converged, sliding, force, share, who)
