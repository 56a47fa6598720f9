"""Check whether elements are small enough for the flesh between bones and skin, which forces depend on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.mesh.envelope import Envelope
from warpjld.fem.mesh.hexmesh import EDGES
from warpjld.skeleton.hand import DIGITS

__all__ = ["Cushion", "coarse_note", "cushions"]

_ENOUGH = 2  # smallest number of elements between bone and skin: a single one cannot bend
_MISSING = 0.1
"""Largest depth, per depth of the flesh, by which flat faces may cut off curved skin."""
_PALMAR = 0.8
"""Smallest cosine between the palmar direction and that from the bone to the skin, for skin of the palmar side."""
_STEP = 1e-4
"""Resolution of recommended element sizes [m]."""


@dataclass(frozen=True)
class Cushion:
    """Flesh between a phalanx and the palmar skin.

    Attributes:
        segment: Name of the bone's segment, such as ``left.index.distal``.
        elements: Number of elements between bone and skin, the median over that skin.
        depth: Depth of the flesh [m], likewise.
        missing: Depth of the elements' outer face centres under the skin [m], likewise.
    """

    segment: str
    elements: int
    depth: float
    missing: float

    @property
    def enough(self) -> bool:
        """Whether forces are reliable: a single element is too stiff, flat faces make a finger too thin."""
        return self.elements >= _ENOUGH and self.missing <= _MISSING * self.depth

    @property
    def size(self) -> float:
        """Sufficiently small edge length of elements [m]."""
        return max(_STEP, _STEP * float(np.floor(self.depth / _ENOUGH / _STEP)))


def cushions(hand: FleshHand) -> tuple[Cushion, ...]:
    """The flesh of every phalanx of a hand at rest."""
    mesh, flesh = hand.mesh, hand.flesh
    quads = mesh.quads(hand.skin_faces)
    middles = mesh.nodes[quads].mean(axis=1)
    mine = hand.weights[quads].sum(axis=1).argmax(axis=1)
    under = -Envelope(hand.surface.vertices, hand.surface.faces).ask(middles).distance
    links = _adjacency(mesh.elements, len(mesh.nodes))
    out = []
    for number, (shaft, near) in enumerate(zip(flesh.shafts, flesh.parents, strict=True)):
        name = hand.segments[number].split(".")
        if len(name) < 2 or name[-2] not in DIGITS:
            continue
        share, off, radius = shaft.around(middles)
        palm = -np.cross(shaft.along, hand.skeleton.axes[near])
        size = np.linalg.norm(off, axis=1)
        facing = off @ palm > _PALMAR * size * np.linalg.norm(palm)
        over = facing & (mine == number) & (share > shaft.near) & (share < shaft.far)
        if over.any():
            levels = _edge_distances(links, hand.bone_nodes[number], quads[over])
            depth = float(np.median((size + under - radius)[over]))
            out.append(Cushion(hand.segments[number], int(np.median(levels)), depth, float(np.median(under[over]))))
    return tuple(out)


def coarse_note(found: Sequence[Cushion], spacing: float, digits: Sequence[str] = ()) -> str | None:
    """A warning about elements that are too large, or None.

    Args:
        found: The hand's ``cushions``.
        spacing: Edge length of its elements [m].
        digits: Digits to check, such as ``index``; all if empty.
    """
    thin = [one for one in found if not one.enough and (not digits or one.segment.split(".")[-2] in digits)]
    if not thin:
        return None
    worst: dict[str, Cushion] = {}
    for one in sorted(thin, key=lambda one: one.size):
        worst.setdefault(one.segment.split(".")[-2], one)
    listed = ", ".join(f"{digit} (at most {1e3 * one.size:.1f} mm)" for digit, one in worst.items())
    return (
        f"elements of {1e3 * spacing:g} mm are too large for the flesh over the bones, forces may be far off: {listed}"
    )


def _adjacency(elements: NDArray[np.int32], count: int) -> Any:
    """Adjacency matrix of ``count`` nodes by element edges, a symmetric ``csr_array``."""
    one, other = elements[:, EDGES].reshape(-1, 2).T
    links = csr_array((np.ones(len(one), np.float32), (one, other)), shape=(count, count))
    return csr_array(links + links.T)


def _edge_distances(links: Any, start: NDArray[np.integer], wanted: NDArray[np.integer]) -> NDArray[np.int64]:
    """Number of edges from each wanted node to the nearest start node, in their shape; -1 if unconnected."""
    out = np.full(links.shape[0], -1)
    out[start] = 0
    level, front = 0, np.zeros(len(out), np.float32)
    while (out[wanted] < 0).any():
        front[:] = out == level
        level += 1
        fresh = (out < 0) & (links @ front > 0.0)
        if not fresh.any():
            break
        out[fresh] = level
    return np.asarray(out[wanted])
