"""Limit loads: a shell beyond its limit pressure is no success, one text says so, and arc length follows the path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import bsr_array

from warpjld.fem import (
    Body,
    Loads,
    NeoHooke,
    Prescribed,
    Solution,
    SolveError,
    SolveStatus,
    ball_hexes,
    box_hexes,
    prescribe,
    solve,
)
from warpjld.fem.load.loads import subtract_pressure_stiffness

YOUNG, POISSON, THICK = 1e6, 0.3, 0.05
CLASSICAL = 2.0 * YOUNG * THICK**2 / np.sqrt(3.0 * (1.0 - POISSON**2))
"""Zoelly's buckling pressure of a sphere of radius 1 [Pa]; a coarse mesh of linear elements is stiffer."""


def shell(n: int) -> tuple[Body, Prescribed]:
    mesh = ball_hexes(1.0 + THICK / 2, inner=1.0 - THICK / 2, n=n, layers=1, octant=True)
    held = prescribe(mesh, "x0", x=0.0) + prescribe(mesh, "y0", y=0.0) + prescribe(mesh, "z0", z=0.0)
    return Body(mesh, NeoHooke(YOUNG, POISSON)), held


def squeezed(body: Body, held: Prescribed, times: float, **options: object) -> Solution:
    return solve(body, held, Loads(pressure={"outer": times * CLASSICAL}), check=False, **options)  # type: ignore[arg-type]


def least_eigenvalue(body: Body, held: Prescribed, pressure: float, u: np.ndarray) -> float:
    """Of the free tangent, dense."""
    tangent = body.at(u).stiffness
    assert tangent is not None
    subtract_pressure_stiffness(tangent, body, Loads(pressure={"outer": pressure}), u.reshape(-1))
    whole = bsr_array((tangent.values, tangent.columns, tangent.rows)).tocsr()
    free = np.flatnonzero(held.free(body.degrees))
    inside = whole[free][:, free].toarray()
    return float(np.linalg.eigvalsh(0.5 * (inside + inside.T))[0])


def test_below_the_limit_pressure_nothing_is_said() -> None:
    body, held = shell(4)
    found = squeezed(body, held, 1.0)
    assert found.status is SolveStatus.CONVERGED
    assert least_eigenvalue(body, held, CLASSICAL, found.displacement) > 0.0


def test_one_limit_pressure_and_one_text_whatever_the_load() -> None:
    """It once came back as converged, in a shape with negative eigenvalues, or with one of three texts."""
    body, held = shell(3)
    limits = []
    for times in (6.0, 24.0):
        found = squeezed(body, held, times)
        assert found.status is SolveStatus.LIMIT_LOAD
        assert found.message.startswith("limit load: above ")
        limits.append(times * found.last.factor)
        assert least_eigenvalue(body, held, limits[-1] * CLASSICAL, found.displacement) > 0.0
    np.testing.assert_allclose(limits, limits[0], rtol=5e-3)


def test_a_limit_load_raises_where_results_are_checked() -> None:
    body, held = shell(2)
    with pytest.raises(SolveError, match="limit load"):
        solve(body, held, Loads(pressure={"outer": 12.0 * CLASSICAL}))


def arch(**options: object) -> Solution:
    """A shallow strip bent up by a tenth of its half span, clamped at its end, pushed down in the middle."""
    mesh = box_hexes((1.0, 0.05, 0.05), (16, 1, 1))
    nodes = mesh.nodes.copy()
    nodes[:, 2] += 0.12 * np.cos(0.5 * np.pi * nodes[:, 0]) ** 2
    mesh = replace(mesh, nodes=nodes)
    held = prescribe(mesh, "x-", x=0.0) + prescribe(mesh, "x+", x=0, y=0, z=0) + prescribe(mesh, "y-", y=0.0)
    load = Loads(traction={"x-": (0.0, 0.0, -1000.0)})
    return solve(Body(mesh, NeoHooke(1e6, 0.3)), held, load, check=False, **options)  # type: ignore[arg-type]


def test_arc_length_follows_a_snap_through() -> None:
    """By load alone the strip jumps, or its limit is named; along the path the load falls, then rises to the full."""
    jumped, followed = arch(instants=20), arch(instants=20, arc_length=True)
    assert followed.status is SolveStatus.CONVERGED, followed.message
    factors = np.array([instant.factor for instant in followed.instants])
    fallen = np.flatnonzero(np.diff(factors) < 0.0)
    assert len(fallen) > 1
    assert followed.message == f"converged, beyond a limit load of {factors[fallen[0]]:.4g} of the load"
    assert all(instant.residual < 1e-8 for instant in followed.instants)
    if jumped.status is SolveStatus.CONVERGED:
        np.testing.assert_allclose(followed.displacement, jumped.displacement, atol=1e-6)
    else:
        assert jumped.last.factor == pytest.approx(factors[fallen[0]], rel=0.05)
