"""What a pair's contact points say, node by node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.border import pressed_at_nodes
from warpjld.fem.contact.law import Response
from warpjld.fem.contact.points import ContactPoints, Interface
from warpjld.fem.contact.solution import Touch

__all__ = ["touch_of"]


def touch_of(
    interface: Interface,
    points: ContactPoints,
    response: Response,
    slip: NDArray[np.float64],
    bonded: NDArray[np.bool_],
    modulus: NDArray[np.float64],
    x: NDArray[np.float64],
) -> Touch:
    """A pair at an instant, from its points (m) to its slave nodes (n): averages by area; of gaps the least.

    Args:
        interface: The pair.
        points: Its points.
        response: Their tractions.
        slip: Relative displacement in the step [m], shape (m, 3).
        bonded: Whether the bond holds, one for each site.
        modulus: E* at all slave nodes [Pa], for the border of contact (see ``border``).
        x: Positions of the body's nodes [m], shape (N, 3).
    """
    share = interface.share[points.sites]
    weight = share.T.multiply(points.area).tocsr()
    area = np.asarray(weight.sum(axis=1)).ravel()
    near = np.flatnonzero(area > 0.0)
    area = area[near]
    mean = weight[near] / area[:, None]
    mean = mean.tocsr()
    traction = response.traction(points)
    across = slip - np.einsum("mi,mi->m", slip, points.normal)[:, None] * points.normal
    normal = mean @ points.normal
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    nodes = interface.slave.nodes[near]
    pressure = mean @ response.pressure
    gap = np.minimum.reduceat(points.gap[mean.indices], mean.indptr[:-1]) if len(near) else np.empty(0)
    holds = mean @ bonded[points.sites].astype(float) > 0.0
    pressed = np.where(holds, area, pressed_at_nodes(interface, near, pressure, mean @ points.gap, area, modulus, x))
    return Touch(
        name=interface.pair.label,
        nodes=nodes,
        position=x[nodes],
        normal=np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0),
        pressure=pressure,
        traction=mean @ traction,
        gap=gap,
        area=area,
        pressed=pressed,
        slip=mean @ across,
        sticking=mean @ (response.sticking & response.active).astype(float)
        > 0.5 * (mean @ response.active.astype(float)),
        bonded=holds,
        nodal=points.forces(traction),
    )
