"""Simulated tactile readings: force, pressure, area, slip and stick of every pad over time (R95, R125)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import ContactInstant
from warpjld.fem.contact.results.nodal_contact import NodalContact, tributary_areas
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.hand.labels import WEB
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame

__all__ = ["Tactile", "tactile_of", "tactile_of_pairs", "tactile_readings"]


@dataclass(frozen=True, eq=False)
class Tactile:
    """Readings of P pads at T times; a pad is the skin of one segment. NaN where a quantity is undefined.

    Attributes:
        times: Shape (T,).
        pads: Names of the pads: ``left.index.distal``, ``left.palm.thumb``, ….
        force: Contact force on the pad, friction included [N], shape (T, P, 3).
        normal_force: Sum of the normal forces [N], shape (T, P).
        centre: Centre of pressure [m], shape (T, P, 3).
        area: Contact area, with its border interpolated between nodes [m²], shape (T, P).
        peak: Highest pressure: normal force on a node over its tributary area [Pa], shape (T, P).
        slip: Slip distance since the previous time, mean over the contact area [m], shape (T, P).
        sticking: Share of the contact area that sticks, shape (T, P).
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
        """Mask of the pads in contact, shape (T, P)."""
        return np.asarray(self.normal_force > 0.0)


def tactile_of(hand: FleshHand, instants: Sequence[ContactInstant], *, only: str | None = None) -> Tactile:
    """Readings of a hand's pads, as slave or master of a pair: sums over the nodes of each pad.

    Args:
        hand: The hand; its nodes are the first of the merged mesh.
        instants: Equilibria.
        only: Name of a single pair to read (``PairContact.name``); None: all pairs.

    Raises:
        InputError: No instant, or no pair of that name.
    """
    if only is not None:
        known = sorted({touch.name for instant in instants for touch in instant.touches})
        if only not in known:
            raise InputError(f"tactile: there is no pair '{only}'; there are {', '.join(known) or 'none'}")
    count = len(hand.mesh.nodes)
    read = [
        (
            instant.time,
            instant.displacement[:count],
            [(one.nodal[:count], one.nodal_contact) for one in instant.touches if only in (None, one.name)],
        )
        for instant in instants
    ]
    return _read_all(hand, read)


def tactile_readings(model: ContactModel, hand: FleshBody, frames: Sequence[SolvedFrame]) -> Tactile:
    """Readings of the pads of a simulated hand; times are frame numbers.

    Raises:
        InputError: No frame.
    """
    span = model.spans[hand.name]
    mine = [k for k, owner in enumerate(model.owners) if owner.other(hand.name) is not None]
    read = [
        (one.frame, one.displacement[span], [(one.nodal[k, span], one.nodal_contact.of((k, span))) for k in mine])
        for one in frames
    ]
    return _read_all(hand.hand, read)


_Reading = tuple[float, NDArray[np.float64], list[tuple[NDArray[np.float64], NodalContact]]]
"""Time, displacements of the hand's nodes, and nodal forces and nodal contact of each pair."""


def _read_all(hand: FleshHand, read: Sequence[_Reading]) -> Tactile:
    if not read:
        raise InputError("tactile: want at least one instant")
    pads = tuple(name for name in hand.label_names if not name.endswith(WEB))
    place = np.array([pads.index(n) if n in pads else -1 for n in hand.label_names])
    pad_of = np.where(hand.node_labels >= 0, place[hand.node_labels], -1)
    out = _without_contact([time for time, _, _ in read], pads)
    for frame, one in enumerate(read):
        _read(hand, pad_of, one, out, frame)
    return out


def _without_contact(times: Sequence[float], pads: tuple[str, ...]) -> Tactile:
    """Readings without contact, to be filled in."""
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


def _read(hand: FleshHand, pad_of: NDArray[np.int64], read: _Reading, out: Tactile, frame: int) -> None:
    """Fill in row ``frame`` of ``out``; ``pad_of``: index of each node's pad, -1 for none, shape (N,)."""
    count, pads = len(hand.mesh.nodes), len(out.pads)
    x = hand.mesh.nodes + read[1]
    skin = np.flatnonzero(pad_of >= 0)
    pad = pad_of[skin]
    summed = {name: np.zeros(count) for name in ("force", "area", "held", "slid")}
    for nodal, nodal_contact in read[2]:
        np.add.at(out.force[frame], pad, nodal[skin])
        for name, values in summed.items():
            values += getattr(nodal_contact, name)[:count]
    force, area, held, slid = (np.bincount(pad, values[skin], pads) for values in summed.values())
    around = tributary_areas(hand.mesh, hand.skin_faces, x)[skin]
    weighted = np.stack([np.bincount(pad, summed["force"][skin] * x[skin, k], pads) for k in range(3)], axis=1)
    np.maximum.at(out.peak[frame], pad, summed["force"][skin] / np.maximum(around, 1e-300))
    loaded, touching = force > 0.0, area > 0.0
    out.normal_force[frame], out.area[frame] = force, area
    out.centre[frame, loaded] = weighted[loaded] / force[loaded, None]
    out.slip[frame, touching] = slid[touching] / area[touching]
    out.sticking[frame, touching] = held[touching] / area[touching]


def tactile_of_pairs(instants: Sequence[ContactInstant]) -> Tactile:
    """Readings with the slave surface of every pair as one pad, named after the pair; for bodies without a hand.

    Args:
        instants: Equilibria with the same contact pairs.

    Raises:
        InputError: No instant, or different pairs.
    """
    if not instants:
        raise InputError("tactile: want at least one instant")
    pads = tuple(touch.name for touch in instants[0].touches)
    if any(tuple(touch.name for touch in instant.touches) != pads for instant in instants):
        raise InputError("tactile: want the same pairs at every instant")
    out = _without_contact([instant.time for instant in instants], pads)
    for frame, instant in enumerate(instants):
        for pad, touch in enumerate(instant.touches):
            area, total = touch.contact_area, touch.area @ np.maximum(touch.pressure, 0.0)
            if total > 0.0:
                out.force[frame, pad] = touch.force
                out.normal_force[frame, pad] = total
                out.centre[frame, pad] = touch.centre
                out.peak[frame, pad] = touch.peak
            if area > 0.0:
                out.area[frame, pad] = area
                out.slip[frame, pad] = touch.pressed @ np.linalg.norm(touch.slip, axis=1) / area
                out.sticking[frame, pad] = 1.0 - touch.sliding
    return out
