"""Static feasibility: whether contact forces inside the friction cones could balance the loads on a free body.

A search that finds no equilibrium does not prove that there is none. For a body held by contact alone, forces f_i at
its contacts with |f_t| ≤ μ f_n, and arbitrary ones at prescribed degrees of freedom, have to balance its loads in force
and moment. If there are no such forces, nothing can hold the body. (If there are, deformable bodies may still not
develop them.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpjld.fem.arrays import Array, Ints
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints

__all__ = ["could_balance"]

_EDGES = 64
"""Edges of the pyramids circumscribed about the friction cones; they exceed the cones by 1.2 ‰."""
_MOST = 60
"""Most contact points per interface; of more, an evenly spaced subset is used."""
_BALANCED = 2e-3
"""Tolerance of the balance: residual force and moment (over the body's size) relative to the loads."""


def could_balance(
    nodes: Ints,
    x: Array,
    force: Array,
    held: Ints,
    interfaces: Sequence[Interface],
    points: Sequence[ContactPoints],
) -> bool:
    """Whether forces at its contacts and supports could balance the loads on a body.

    Args:
        nodes: Nodes of the body, shape (n,).
        x: Positions of all nodes [m], shape (N, 3).
        force: Loads on all nodes [N], shape (N, 3).
        held: Prescribed degrees of freedom of all bodies.
        interfaces: Contact interfaces.
        points: Candidate contact points of each.
    """
    from scipy.optimize import nnls

    mine = np.zeros(len(x), dtype=bool)
    mine[nodes] = True
    centre = x[nodes].mean(axis=0)
    size = max(float(np.linalg.norm(x[nodes] - centre, axis=1).max()), 1e-300)
    columns: list[Array] = []

    def add(at: Array, along: Array) -> None:
        columns.append(np.concatenate([along, np.cross(at - centre, along) / size], axis=1))

    for interface, p in zip(interfaces, points, strict=True):
        rows = _even(np.flatnonzero(abs(p.weights) @ mine.astype(float) > 0.0))
        for row in rows:
            weights = p.weights[[row]]
            its, share = weights.indices, weights.data
            own = mine[its]
            total = float(share[own].sum())
            if abs(total) < 1e-9:
                continue
            at = (share[own] @ x[its[own]]) / total
            cone = _cone(-np.sign(total) * p.normal[row], interface.pair.friction)
            if interface.pair.bond is not None:
                cone = np.concatenate([np.eye(3), -np.eye(3)])
            add(np.tile(at, (len(cone), 1)), cone)
    fixed = held[mine[held // 3]]
    if len(fixed):
        axis = np.eye(3)[fixed % 3]
        for sign in (1.0, -1.0):
            add(x[fixed // 3], sign * axis)
    pull = force[nodes]
    wanted = -np.concatenate([pull.sum(axis=0), np.cross(x[nodes] - centre, pull).sum(axis=0) / size])
    scale = float(np.linalg.norm(wanted))
    if scale <= 1e-12 * float(np.linalg.norm(pull)) or scale == 0.0:
        return True
    if not columns:
        return False
    left = nnls(np.concatenate(columns).T, wanted / scale)[1]
    return bool(left < _BALANCED)


def _even(rows: Ints) -> Ints:
    """Evenly spaced subset of rows, at most ``_MOST``."""
    return rows if len(rows) <= _MOST else rows[np.linspace(0, len(rows) - 1, _MOST).astype(np.int64)]


def _cone(normal: Array, friction: float) -> Array:
    """Edges of the pyramid circumscribed about the friction cone of a unit normal, shape (k, 3)."""
    if friction == 0.0:
        return normal[None]
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    side /= np.linalg.norm(side)
    turn = 2.0 * np.pi * (np.arange(_EDGES) + 0.5) / _EDGES
    across = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(normal, side)
    return np.asarray(normal + friction / np.cos(np.pi / _EDGES) * across)
