"""Fields of shells that lie on the skin, read from the skin: nails, eyes and clothes go with what is under them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.fields import Fields
from warpjld.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
    from scipy.sparse import csgraph
else:
    sp = lazy_module("scipy.sparse")
    csgraph = lazy_module("scipy.sparse.csgraph")

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
    if not _several(faces, rigid):
        return None
    from warpjld.covering.shells import shells

    found = shells(vertices, faces, lines, rigid)
    bends = ~found.whole[found.label] | (rigid >= 0)
    return Following(found.follow, sp.csr_array(sp.diags_array(bends.astype(np.float64)) @ found.follow))


def _several(faces: NDArray[np.int32], rigid: NDArray[np.int32]) -> bool:
    """Whether flesh lies in more than one connected shell."""
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = sp.coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(len(rigid), len(rigid)))
    label = csgraph.connected_components(graph, directed=False)[1]
    used = np.zeros(len(rigid), dtype=bool)
    used[faces.ravel()] = True
    return len(np.unique(label[used & (rigid < 0)])) > 1
