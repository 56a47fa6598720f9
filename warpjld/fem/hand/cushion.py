"""Whether elements are small enough for the flesh between bones and skin: forces depend on it."""

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

_ENOUGH = 2  # elements through the flesh over a bone: one alone cannot bend
_MISSING = 0.1
"""Share of the flesh's depth that flat faces may cut off round skin, at their middles."""
_PALMAR = 0.8
"""Least cosine between where skin lies off a bone and the palm's side."""
_STEP = 1e-4
"""Sizes of elements are told in these steps [m]."""


@dataclass(frozen=True)
class Cushion:
    """Flesh between a phalanx and the skin of the palm's side.

    Attributes:
        segment: Of the bone, as ``left.index.distal``.
        elements: Elements between bone and skin, the median over that skin.
        depth: Flesh there [m], likewise.
        missing: How deep under the skin the middles of the elements' faces lie [m], likewise.
    """

    segment: str
    elements: int
    depth: float
    missing: float

    @property
    def enough(self) -> bool:
        """Whether forces can be trusted: a single element is too stiff, flat faces make a finger too thin."""
        return self.elements >= _ENOUGH and self.missing <= _MISSING * self.depth

    @property
    def size(self) -> float:
        """Edge length of elements that would do [m]."""
        return max(_STEP, _STEP * float(np.floor(self.depth / _ENOUGH / _STEP)))


def cushions(hand: FleshHand) -> tuple[Cushion, ...]:
    """Of every phalanx, for a hand where its rig rests."""
    mesh, flesh = hand.mesh, hand.flesh
    quads = mesh.quads(hand.skin_faces)
    middles = mesh.nodes[quads].mean(axis=1)
    mine = hand.weights[quads].sum(axis=1).argmax(axis=1)
    under = -Envelope(hand.surface.vertices, hand.surface.faces).ask(middles).distance
    links = _links(mesh.elements, len(mesh.nodes))
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
            levels = _levels(links, hand.bone_nodes[number], quads[over])
            depth = float(np.median((size + under - radius)[over]))
            out.append(Cushion(hand.segments[number], int(np.median(levels)), depth, float(np.median(under[over]))))
    return tuple(out)


def coarse_note(found: Sequence[Cushion], spacing: float, digits: Sequence[str] = ()) -> str | None:
    """What to tell people of a hand's elements that are too large, if they are.

    Args:
        found: Its ``cushions``.
        spacing: Edge length of its elements [m].
        digits: Those that matter, as ``index``; none for all.
    """
    thin = [one for one in found if not one.enough and (not digits or one.segment.split(".")[-2] in digits)]
    if not thin:
        return None
    worst: dict[str, Cushion] = {}
    for one in sorted(thin, key=lambda one: one.size):
        worst.setdefault(one.segment.split(".")[-2], one)
    told = ", ".join(f"{digit} (at most {1e3 * one.size:.1f} mm)" for digit, one in worst.items())
    return f"elements of {1e3 * spacing:g} mm are too large for the flesh over the bones, forces may be far off: {told}"


def _links(elements: NDArray[np.int32], count: int) -> Any:
    """Which of ``count`` nodes an edge of an element joins, symmetric ``csr_array``."""
    one, other = elements[:, EDGES].reshape(-1, 2).T
    links = csr_array((np.ones(len(one), np.float32), (one, other)), shape=(count, count))
    return csr_array(links + links.T)


def _levels(links: Any, start: NDArray[np.integer], wanted: NDArray[np.integer]) -> NDArray[np.int64]:
    """Edges between each wanted node and the nearest of the start nodes, -1 where there is no way, in their shape."""
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
