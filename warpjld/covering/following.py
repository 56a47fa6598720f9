"""Fields of shells that lie on the skin, read from the skin: nails, eyes and clothes go with what is under them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.fields import Fields
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Following", "following"]


@dataclass(frozen=True, eq=False)
class Following:
    """What every vertex reads its coefficients from; linear, so gradients run back through the transposes.

    Attributes:
        follow: Sparse (V, V), rows summing to one: the identity's but on shells that lie on others.
        bending: ``follow`` without the rows of small shells, which move rigidly: a nail neither rounds at a joint nor
            swells with a muscle.
    """

    follow: sp.csr_array
    bending: sp.csr_array

    def of(self, fields: Fields) -> Fields:
        """Fields of the whole surface, from those of the skin."""
        return Fields(
            self.follow @ fields.positions,
            self.follow @ fields.turns,
            self.bending @ fields.roundings,
            self.bending @ fields.swellings,
            self.bending @ fields.palm,
            self.bending @ fields.muscles,
        )

    def adjoint(self, slopes: Fields) -> Fields:
        """Derivatives by the skin's fields of a number whose derivatives by those of the whole surface are given."""
        return Fields(
            sp.csr_array(self.follow.T @ slopes.positions),
            sp.csr_array(self.follow.T @ slopes.turns),
            sp.csr_array(self.bending.T @ slopes.roundings),
            sp.csr_array(self.bending.T @ slopes.swellings),
            sp.csr_array(self.bending.T @ slopes.palm),
            sp.csr_array(self.bending.T @ slopes.muscles),
        )


def following(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], lines: NDArray[np.float64], rigid: NDArray[np.int32]
) -> Following | None:
    """What shells of a surface follow; None where its flesh is a single shell. Arguments as of ``shells``."""
    from warpjld.covering.shells import shell_numbers, shells

    used = np.zeros(len(rigid), dtype=bool)
    used[faces.ravel()] = True
    if len(np.unique(shell_numbers(faces, len(rigid))[used & (rigid < 0)])) <= 1:
        return None
    found = shells(vertices, faces, lines, rigid)
    bends = ~found.whole[found.label] | (rigid >= 0)
    return Following(found.follow, sp.csr_array(sp.diags_array(bends.astype(np.float64)) @ found.follow))
