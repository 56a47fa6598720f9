"""What a symmetric stiffness of contact leaves out, against differences of gaps and forces as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fem.contact.bodies import named
from warpjld.fem import box_hexes, merge
from warpjld.fem.contact import Pair
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState, initial_state
from warpjld.fem.contact.law.return_mapping import ContactTractions, return_mapping
from warpjld.fem.contact.solver.tangent import MortarTangent, linearise_mortar

EXACT = 1e-5
"""Differences of one in a million of an edge, of polygons with corners that come and go."""


class WavyBlocks:
    """Two wavy blocks on each other, of different meshes, one turned, with pressures on some of what they share."""

    def __init__(self, seed: int, offset: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        low = named(box_hexes((1.0, 1.0, 0.4), (5, 5, 2)), "a", (-0.5, -0.5, -0.4))
        high = named(box_hexes((1.0, 1.0, 0.4), (4, 4, 2)), "b", (-0.45, -0.52, 0.0))
        c, s = np.cos(0.2), np.sin(0.2)
        high = replace(high, nodes=high.nodes @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
        self.mesh = merge(low, high)
        self.x = self.mesh.nodes + 5e-4 * rng.normal(size=self.mesh.nodes.shape)
        self.x[:, 2] += 0.04 * np.sin(3.0 * self.x[:, 0] + 1.0) * np.cos(2.0 * self.x[:, 1])
        seen = offset * rng.uniform(size=len(self.x)) if offset else None
        self.pair = Pair("a.z+", "b.z-", offset=seen)
        self.x[:, 2] -= np.where(self.mesh.nodes[:, 2] < 0.0, offset, 0.0)  # what is seen lies outside
        self.interface = Interface(self.mesh, self.pair, 1)
        found = self.interface.points(self.x, 0.0, 0.0)
        pressure = np.zeros(len(self.interface.edge))
        pressure[found.sites] = np.where(
            np.abs(found.gap) < 4e-3, rng.uniform(0.5, 1.0, len(found.sites)), -9.0
        )  # stays out
        self.state: ContactState = replace(initial_state(len(self.interface.edge), self.pair), pressure=pressure)

    def at(self, x: NDArray[np.float64]) -> tuple[ContactPoints, ContactTractions, NDArray[np.float64]]:
        points = self.interface.points(x, 0.0, 0.0)
        penalty = np.full(len(points.sites), 5.0)
        slip = np.zeros((len(points.sites), 3))
        return points, return_mapping(self.pair, points, self.state, slip, penalty, 0.0, ActiveSet.FROZEN), penalty

    def slopes(self) -> tuple[ContactPoints, ContactTractions, MortarTangent]:
        points, tractions, penalty = self.at(self.x)
        mortar = self.interface.mortar
        assert mortar is not None
        # the solver takes the multipliers for the tractions: here they are what presses, for differences to agree
        held = np.zeros_like(self.state.pressure)
        held[points.sites] = tractions.pressure
        state = replace(self.state, pressure=held)
        found = linearise_mortar(mortar, points, tractions, state, penalty, self.x, self.interface.reach)
        assert found is not None
        return points, tractions, found


@pytest.mark.parametrize(("seed", "offset"), [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.005)])
def test_against_differences(seed: int, offset: float) -> None:
    touching = WavyBlocks(seed, offset)
    points, tractions, slopes = touching.slopes()
    active = tractions.active
    assert 3 < active.sum() < len(active)
    assert (tractions.pressure[active] > 0.0).all()
    rng = np.random.default_rng(seed + 10)
    step = 1e-7
    for _ in range(4):
        way = rng.normal(size=touching.x.shape)
        (ahead, pushed, _), (behind, pulled, _) = (touching.at(touching.x + s * step * way) for s in (1.0, -1.0))
        gap = (ahead.gap - behind.gap)[active] / (2.0 * step)
        frozen = points.opened(way)[active]
        found = replace(points, gap_derivative=slopes.gap).opened(way)[active]
        np.testing.assert_allclose(found, gap, rtol=0, atol=EXACT * np.abs(gap).max())
        assert np.abs(frozen - gap).max() > 100.0 * EXACT * np.abs(gap).max()
        change = (ahead.forces(pushed.traction(ahead)) - behind.forces(pulled.traction(behind))) / (2.0 * step)
        symmetric = points.weights.T @ np.einsum("mij,mj->mi", tractions.blocks, points.weights @ way)
        beside = (slopes.forces @ way.ravel()).reshape(-1, 3)
        np.testing.assert_allclose(-(symmetric + beside), change, rtol=0, atol=EXACT * np.abs(change).max())


def test_moved_as_a_whole_nothing_changes() -> None:
    touching = WavyBlocks(3)
    points, _, slopes = touching.slopes()
    for axis in np.eye(3):
        shift = np.broadcast_to(axis, touching.x.shape).ravel()
        assert np.abs(slopes.gap @ shift).max() < EXACT * np.abs(slopes.gap).max()
        assert np.abs(slopes.forces @ shift).max() < EXACT * np.abs(slopes.forces).max()
    # gaps do not change when everything turns
    x = touching.x
    turn = np.cross([0.3, -0.5, 0.8], x)
    assert np.abs(replace(points, gap_derivative=slopes.gap).opened(turn)).max() < 1e-4 * np.abs(turn).max()


def test_nothing_where_nothing_touches() -> None:
    touching = WavyBlocks(0)
    points, tractions, penalty = touching.at(touching.x)
    mortar = touching.interface.mortar
    assert mortar is not None
    idle = replace(tractions, active=np.zeros_like(tractions.active))
    assert linearise_mortar(mortar, points, idle, touching.state, penalty, touching.x, 1.0) is None


def test_gaps_do_not_jump() -> None:
    """Facets that turn away, or slide off, fade: gaps are continuous where they come and go."""
    touching = WavyBlocks(0)
    count = len(touching.mesh.node_set("a"))
    worst = 0.0
    before: NDArray[np.float64] | None = None
    step = 2e-3
    for k in range(60):
        x = touching.x.copy()
        x[count:, 0] += k * step
        points = touching.interface.points(x, 0.0, 0.0)
        gap = np.full(len(touching.interface.edge), np.nan)
        whole = points.area > 0.3 * touching.interface.edge[points.sites] ** 2
        gap[points.sites[whole]] = points.gap[whole]
        if before is not None:
            worst = max(worst, float(np.nanmax(np.abs(gap - before))))
        before = gap
    assert worst < 3.0 * step
