"""What a load step goes from and to."""

from __future__ import annotations

from dataclasses import dataclass

from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed

__all__ = ["Step"]


@dataclass(frozen=True, eq=False)
class Step:
    """A load step.

    Attributes:
        before: Time it starts from.
        time: Time it goes to.
        prescribed: Displacements at ``time``.
        loads: Loads at ``time``.
        allowed: Share of the overlap at the start that is still allowed at ``time``.
    """

    before: float
    time: float
    prescribed: Prescribed
    loads: Loads
    allowed: float
