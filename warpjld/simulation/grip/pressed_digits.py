"""Forces of digits at an equilibrium, and the shares by which they are to be alike (R118, R123)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["PressedDigits"]


@dataclass(frozen=True, eq=False)
class PressedDigits:
    """Forces of the digits at an equilibrium.

    Attributes:
        forces: Force of each digit [N], shape (D,).
        shares: Largest load share (load over limit) of each digit's muscles, or of other limits, shape (D,).
        slopes: Derivative of the share of digit i with respect to the closing of digit j [1/rad], shape (D, D); None if
            unknown.
        load: Largest load share of the muscles, if shares are those of other limits.
    """

    forces: NDArray[np.float64]
    shares: NDArray[np.float64]
    slopes: NDArray[np.float64] | None = None
    load: float | None = None

    @property
    def strain(self) -> float:
        """Largest load share of the muscles."""
        return float(self.shares.max()) if self.load is None else self.load
