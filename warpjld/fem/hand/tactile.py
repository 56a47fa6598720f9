"""What the skin feels: force, pressure, area, slip and grip of every pad over time (R95, R125)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactInstant
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.hand.labels import WEB
from warpjld.fem.hexmesh import HexMesh

__all__ = ["Tactile", "tactile_of", "tactile_of_pairs"]


class _Touch(Protocol):
    """What is read of one pair at one instant (``warpjld.fem.contact.Touch``)."""

    @property
    def name(self) -> str: ...
    @property
    def nodes(self) -> NDArray[np.int32]: ...
    @property
    def pressure(self) -> NDArray[np.float64]: ...
    @property
    def area(self) -> NDArray[np.float64]: ...
    @property
    def slip(self) -> NDArray[np.float64]: ...
    @property
    def sticking(self) -> NDArray[np.bool_]: ...
    @property
    def nodal(self) -> NDArray[np.float64]: ...


class _Instant(Protocol):
    """What is read of one instant (``warpjld.fem.contact.ContactInstant``)."""

    @property
    def time(self) -> float: ...
    @property
    def displacement(self) -> NDArray[np.float64]: ...
    @property
    def touches(self) -> tuple[_Touch, ...]: ...


@dataclass(frozen=True, eq=False)
class Tactile:
    """Readings of P pads at T times; a pad is the skin of one segment. NaN where there is nothing to read.

    Attributes:
        times: Shape (T,).
        pads: ``left.index.distal``, ``left.palm.thumb``, …, P of them.
        force: On the pad, friction included [N], shape (T, P, 3).
        normal_force: Part of it that presses the skin in [N], shape (T, P).
        centre: Centre of pressure [m], shape (T, P, 3).
        area: Area under pressure [m²], shape (T, P).
        peak: Highest pressure [Pa], shape (T, P).
        slip: Sliding since the instant before, mean over that area [m], shape (T, P); NaN where only the other side of
            the contact measured it (the hand as master).
        sticking: Share of the area that sticks, shape (T, P); NaN likewise.
    """

    times: NDArray[np.float64]
    pads: tuple[str, ...]
    force: NDArray[np.float64]
    normal_force: NDArray[np.float64]
    centre: NDArray[np.float64]
    area: NDArray[np.float64]
    peak: NDArray[np.float64]
    slip: NDArray[np.float64]
    sticking: NDArray[np.float64]

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Pads under pressure, shape (T, P)."""
        return np.asarray(self.normal_force > 0.0)


def tactile_of(hand: FleshHand, instants: Sequence[_Instant], *, only: str | None = None) -> Tactile:
    """Read the pads of a hand.

    Where the hand is a pair's slave, its rows are read. Where it is the master, the forces handed to its nodes are:
    area and pressure then come from the share of skin around each node.

    Args:
        hand: The hand, first in the merged mesh.
        instants: Equilibria in contact.
        only: Name of the pair to read (``Touch.name``), where not all are wanted.

    Raises:
        InputError: No instant, or no pair of that name.
    """
    if not instants:
        raise InputError("tactile: want at least one instant")
    if only is not None:
        known = sorted({touch.name for instant in instants for touch in instant.touches})
        if only not in known:
            raise InputError(f"tactile: there is no pair '{only}'; there are {', '.join(known) or 'none'}")
    pads = tuple(name for name in hand.label_names if not name.endswith(WEB))
    place = np.array([pads.index(n) if n in pads else -1 for n in hand.label_names])
    pad_of = np.where(hand.node_labels >= 0, place[hand.node_labels], -1)
    out = _nothing([instant.time for instant in instants], pads)
    for frame, instant in enumerate(instants):
        _read(hand, pad_of, instant, out, frame, only)
    return out


def _nothing(times: Sequence[float], pads: tuple[str, ...]) -> Tactile:
    """Readings where nothing touches."""
    shape = (len(times), len(pads))
    return Tactile(
        np.array(times, dtype=np.float64),
        pads,
        np.zeros((*shape, 3)),
        np.zeros(shape),
        np.full((*shape, 3), np.nan),
        np.zeros(shape),
        np.zeros(shape),
        np.full(shape, np.nan),
        np.full(shape, np.nan),
    )


def _read(
    hand: FleshHand,
    pad_of: NDArray[np.int64],
    instant: _Instant,
    out: Tactile,
    frame: int,
    only: str | None,
) -> None:
    count, pads = len(hand.mesh.nodes), len(out.pads)
    x = hand.mesh.nodes + instant.displacement[:count]
    directions = _node_areas(hand.mesh, hand.skin_faces, x)
    share = np.linalg.norm(directions, axis=1)
    outward = directions / np.maximum(share, 1e-300)[:, None]
    pushed, weighted = np.zeros(pads), np.zeros((pads, 3))
    measured, sliding, stuck = np.zeros(pads), np.zeros(pads), np.zeros(pads)
    for touch in instant.touches:
        if only is not None and touch.name != only:
            continue
        nodal = touch.nodal[:count]
        felt = np.flatnonzero((pad_of >= 0) & nodal.any(axis=1))
        np.add.at(out.force[frame], pad_of[felt], nodal[felt])
        own = touch.nodes < count
        rows = np.flatnonzero(own & (touch.pressure > 0.0))
        if len(rows):
            rows = rows[pad_of[touch.nodes[rows]] >= 0]
        pad = pad_of[touch.nodes[rows]]
        area, pressure = touch.area[rows], touch.pressure[rows]
        np.add.at(measured, pad, area)
        np.add.at(sliding, pad, area * np.linalg.norm(touch.slip[rows], axis=1))
        np.add.at(stuck, pad, area * touch.sticking[rows])
        # nodes of the hand that only the other side's rows push
        passive = np.setdiff1d(felt, touch.nodes[own])
        press = -np.einsum("ni,ni->n", nodal[passive], outward[passive])
        passive, press = passive[press > 0.0], press[press > 0.0]
        nodes = np.concatenate([touch.nodes[rows], passive])
        pad = pad_of[nodes]
        area = np.concatenate([area, share[passive]])
        normal = np.concatenate([pressure * touch.area[rows], press])
        np.add.at(pushed, pad, normal)
        np.add.at(weighted, pad, normal[:, None] * x[nodes])
        np.add.at(out.area[frame], pad, area)
        np.maximum.at(out.peak[frame], pad, normal / np.maximum(area, 1e-300))
    some, known = pushed > 0.0, measured > 0.0
    out.normal_force[frame] = pushed
    out.centre[frame, some] = weighted[some] / pushed[some, None]
    out.slip[frame, known] = sliding[known] / measured[known]
    out.sticking[frame, known] = stuck[known] / measured[known]


def _node_areas(mesh: HexMesh, faces: NDArray[np.int32], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each node's quarter of the faces around it as vectors outwards [m²], shape (N, 3)."""
    quads = mesh.quads(faces)
    corner = x[quads]
    vector = 0.125 * np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    out = np.zeros_like(x)
    for k in range(4):
        np.add.at(out, quads[:, k], vector)
    return out


def tactile_of_pairs(instants: Sequence[ContactInstant]) -> Tactile:
    """Read every pair's slave as one pad, by the pair's name: pads that belong to no hand.

    Args:
        instants: Equilibria in contact, all of the same pairs.

    Raises:
        InputError: No instant, or pairs that change.
    """
    if not instants:
        raise InputError("tactile: want at least one instant")
    pads = tuple(touch.name for touch in instants[0].touches)
    if any(tuple(touch.name for touch in instant.touches) != pads for instant in instants):
        raise InputError("tactile: want the same pairs at every instant")
    out = _nothing([instant.time for instant in instants], pads)
    for frame, instant in enumerate(instants):
        for pad, touch in enumerate(instant.touches):
            pressed = touch.pressure > 0.0
            if not pressed.any():
                continue
            area, force = touch.area[pressed], touch.area[pressed] * touch.pressure[pressed]
            x = touch.position[pressed]
            out.force[frame, pad] = touch.area @ touch.traction
            out.normal_force[frame, pad] = force.sum()
            out.centre[frame, pad] = force @ x / force.sum()
            out.area[frame, pad] = area.sum()
            out.peak[frame, pad] = touch.pressure.max()
            out.slip[frame, pad] = area @ np.linalg.norm(touch.slip[pressed], axis=1) / area.sum()
            out.sticking[frame, pad] = area @ touch.sticking[pressed] / area.sum()
    return out
