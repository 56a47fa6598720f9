"""Transfer of coefficient fields from the skin to shells that lie on it: nails, eyes and clothes follow the skin."""

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
    """Linear map from fields of the skin to those of the whole surface.

    Attributes:
        follow: Interpolation weights, sparse (V, V), rows summing to one; rows of the identity except on shells that
            lie on others.
        bending: ``follow`` with zero rows on small shells, which move rigidly: a nail is neither rounded at a joint nor
            swollen by a muscle.
        whole: Whether a vertex belongs to such a small shell, shape (V,).
    """

    follow: sp.csr_array
    bending: sp.csr_array
    whole: NDArray[np.bool_]

    def of(self, fields: Fields) -> Fields:
        """Fields of the whole surface, from the diffused ones, of which only the skin's are used."""
        return Fields(
            self.follow @ fields.positions,
            self.follow @ fields.turns,
            self.bending @ fields.roundings,
            self.bending @ fields.swellings,
            self.bending @ fields.palm,
            self.bending @ fields.muscles,
        )

    def adjoint(self, slopes: Fields) -> Fields:
        """Derivatives of a number by the skin's fields, from those by the fields of the whole surface (transpose)."""
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
    """Map of fields onto the shells of a surface; None where its flesh is one shell. Arguments as of ``shells``."""
    from warpjld.covering.shells import shell_numbers, shells

    used = np.zeros(len(rigid), dtype=bool)
    used[faces.ravel()] = True
    if len(np.unique(shell_numbers(faces, len(rigid))[used & (rigid < 0)])) <= 1:
        return None
    found = shells(vertices, faces, lines, rigid)
    whole = found.whole[found.label] & (rigid < 0)
    return Following(found.follow, sp.csr_array(sp.diags_array((~whole).astype(np.float64)) @ found.follow), whole)
