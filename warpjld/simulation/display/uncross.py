"""Display correction: a visible skin that passes through itself after contact is drawn back until it does not.

Contact keeps element faces apart on average. In a crease, where skin of two segments of one limb meets, the finer
visible skin passes through itself by a fraction of an element, along whatever segments meet there. Faces that cross
are found, not parts that overlap, so that no partition of the skin is needed: skin of both sides retreats along its
normals, evenly over an element's edge around the crossing, until no two faces cross or it has moved as far as is
allowed. Faces that cross although they lie side by side on the skin are folded by smoothing, not pressed on each other;
there the skin returns to that which elements carry, none of which is turned inside out, or to the covering's, if facets
of the skin larger than elements fold across a crease all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.intersections import crossing_faces, other_pairs
from warpjld.geometry.edge_distance import edge_distance, edge_graph
from warpjld.geometry.normals import vertex_normals
from warpjld.simulation.display.smooth import SurfaceSmoother

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["SkinCrossings", "uncrossed"]

_STEP = 0.08
"""Retreat a round, as a share of the largest one: finer steps retreat less too far, and take as much longer."""
_RETURN = 0.2
"""Part of the way back to the skin as elements carry it a round."""
_ROUNDS = 40
"""Most rounds: thrice what full retreat takes; more are needed only where crossings spread."""


@dataclass(frozen=True, eq=False)
class SkinCrossings:
    """What is needed to find and remove crossings of a body's skin with itself.

    Attributes:
        faces: Triangles of the skin, shape (T, 3).
        rest: Skin at the rig's rest [m], shape (V, 3).
        edge: Edge of the elements, or of two facets of the skin where these are larger [m].
        moves: Mask of the vertices that deformable flesh carries, shape (V,).
        smoother: Smoother over an element's edge.
    """

    faces: NDArray[np.int32]
    rest: NDArray[np.float64]
    edge: float
    moves: NDArray[np.bool_]
    smoother: SurfaceSmoother

    @cached_property
    def _tested(self) -> NDArray[np.int64]:
        """Faces that deformable flesh carries."""
        return np.flatnonzero(self.moves[self.faces].any(axis=1))

    @cached_property
    def _always(self) -> NDArray[np.int32]:
        """Pairs of these that cross at rest, shape (R, 2)."""
        return crossing_faces(self.rest, self.faces[self._tested]).pairs

    @cached_property
    def _graph(self) -> csr_array:
        return edge_graph(self.rest, self.faces)

    def pairs(self, at: NDArray[np.float64]) -> NDArray[np.int64]:
        """Pairs of faces that cross at positions (V, 3) [m] and do not at rest, shape (P, 2)."""
        found = crossing_faces(at, self.faces[self._tested]).pairs
        return np.asarray(self._tested[other_pairs(found, self._always, len(self._tested))])

    def folded(self, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which pairs of faces lie within an element's edge of each other at rest, shape (P,)."""
        middle = self.rest[self.faces[pairs]].mean(axis=2)
        return np.asarray(np.linalg.norm(middle[:, 1] - middle[:, 0], axis=1) < self.edge)

    def around(self, faces: NDArray[np.int64]) -> NDArray[np.float64]:
        """1 at the vertices of faces, falling to 0 over an element's edge along the skin, shape (V,)."""
        start = np.zeros(len(self.rest), dtype=bool)
        start[self.faces[faces]] = True
        away = np.minimum(edge_distance(self._graph, start, self.edge) / self.edge, 1.0)
        return np.where(self.moves, (1.0 - away) ** 2 * (1.0 + 2.0 * away), 0.0)


def uncrossed(
    skin: SkinCrossings, at: NDArray[np.float64], sound: Sequence[NDArray[np.float64]], most: float
) -> NDArray[np.float64]:
    """Positions of a skin's vertices [m], shape (V, 3), after skin that passes through itself has been drawn back.

    Where crossings remain, the positions with the fewest of them.

    Args:
        skin: The skin.
        at: Its vertices [m], shape (V, 3).
        sound: Positions that folds return to, each tried in turn [m], shape (V, 3).
        most: Largest displacement of a vertex [m]; what crosses beyond it still does.
    """
    pairs = skin.pairs(at)
    for goal in sound:
        if not len(pairs):
            break
        at, pairs = _drawn_back(skin, at, pairs, goal, most)
    return at


def _drawn_back(
    skin: SkinCrossings, at: NDArray[np.float64], pairs: NDArray[np.int64], sound: NDArray[np.float64], most: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Positions [m], shape (V, 3), with the fewest crossings while skin with crossing ``pairs`` (P, 2) of faces
    retreats, and folds return to ``sound``; and the pairs of faces that still cross there."""
    inward = -skin.smoother.of(vertex_normals(at, skin.faces).astype(np.float64))
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-300)
    retreat, back = np.zeros(len(at)), np.zeros(len(at))
    best, fewest = at, pairs
    for _ in range(_ROUNDS):
        folded = skin.folded(pairs)
        pressed, folds = pairs[~folded], pairs[folded]
        if (retreat[skin.faces[pressed]] >= most).all() and (back[skin.faces[folds]] >= 1.0).all():
            break
        if len(pressed):
            retreat = np.minimum(most, retreat + _STEP * most * skin.around(pressed))
        if len(folds):
            back = np.minimum(1.0, back + _RETURN * skin.around(folds))
        out = at + retreat[:, None] * inward
        out += back[:, None] * (sound - out)
        length = np.linalg.norm(out - at, axis=1, keepdims=True)
        out = at + (out - at) * np.minimum(1.0, most / np.maximum(length, 1e-300))
        pairs = skin.pairs(out)
        if len(pairs) < len(fewest):
            best, fewest = out, pairs
        if not len(pairs):
            break
    return best, fewest
