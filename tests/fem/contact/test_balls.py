"""Two balls that both deform: softer and stiffer by ten, nearly incompressible, with friction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tests.fem.contact.bodies import mean_gaps, named, together
from warpjld.fem import Body, NeoHooke, Prescribed, ball_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press

STEPS = np.arange(1, 6) / 5
EDGE = 0.25
"""Of the finer ball's faces, about; a step of STEPS is a quarter of it."""
SAG = (0.25**2 + 0.35**2) / 8
"""By which faces of the two polyhedra stay behind the balls they stand for."""


def balls(ratio: float, poisson: float, finer: int = 8, coarser: int = 6) -> tuple[Body, Prescribed]:
    """One over the other, a little aside, pressed together by 0.3 radii beyond the gap of 0.0007 between them."""
    a, b = named(ball_hexes(1.0, n=finer), "a"), named(ball_hexes(1.0, n=coarser), "b", (0.03, 0.02, 2.0))
    body = together({"a": (a, NeoHooke(1.0, poisson)), "b": (b, NeoHooke(ratio, poisson))})
    height = body.mesh.nodes[:, 2]
    low, top = np.flatnonzero(height < -0.5), np.flatnonzero(height > 2.5)
    held = prescribe(body.mesh, low, x=0.0, y=0.0, z=0.0) + prescribe(body.mesh, top, x=0.0, y=0.0, z=-0.3)
    return body, held


def solved(ratio: float, poisson: float, friction: float = 0.0) -> tuple[Body, ContactSolution]:
    body, held = balls(ratio, poisson)
    return body, press(body, held, [Pair("a.outer", "b.outer", friction=friction)], times=STEPS)


def check(body: Body, found: ContactSolution) -> None:
    """Action and reaction, bodies' reactions, overlap."""
    lower = np.isin(np.arange(len(body.mesh.nodes)), body.mesh.node_set("a"))
    for instant in found.instants:
        touch = instant.touches[0]
        size = np.linalg.norm(touch.force)
        assert size > 0.0
        on_a, on_b = (touch.nodal[half].sum(axis=0) for half in (lower, ~lower))
        np.testing.assert_allclose(on_a, touch.force, rtol=0, atol=1e-10 * size)
        np.testing.assert_allclose(on_b, -touch.force, rtol=0, atol=1e-10 * size)
        below, above = (instant.reactions[half].sum(axis=0) for half in (lower, ~lower))
        np.testing.assert_allclose(below, -touch.force, rtol=0, atol=1e-4 * size)  # as far as forces balance
        np.testing.assert_allclose(above, touch.force, rtol=0, atol=1e-4 * size)
        assert touch.penetration <= 1e-3 * EDGE
    gaps = mean_gaps(body, found.last, "a.outer", "b.outer")
    assert abs(gaps.mean()) < 1e-3 * EDGE
    assert np.abs(gaps).max() < 0.15 * SAG  # distances along the polyhedra's normals, not the solver's smooth ones


def forces_and_solves(poisson: float, ratios: Sequence[float]) -> tuple[list[float], list[int]]:
    """Forces and coupled solves a step with balls whose stiffnesses have these ratios."""
    forces, solves = [], []
    for ratio in ratios:
        body, found = solved(ratio, poisson)
        check(body, found)
        assert len(found.steps) == len(STEPS)  # none was halved
        assert np.median(found.steps) <= 6
        assert max(found.steps) <= 8
        solves += found.steps
        forces.append(float(np.linalg.norm(found.last.touches[0].force)))
    assert (np.diff(forces) > 0.0).all()
    return forces, solves


def test_a_soft_and_a_stiff_ball() -> None:
    forces_and_solves(0.49, (10.0,))


@pytest.mark.slow
def test_stiffness_ratios() -> None:
    """Steps of a quarter of an edge: five coupled solves in the median of all, six at most in that of any pair."""
    solves = [n for poisson in (0.3, 0.45, 0.49) for n in forces_and_solves(poisson, (0.1, 0.3, 1.0, 3.0, 10.0))[1]]
    assert np.median(solves) <= 5


@pytest.mark.slow
def test_friction() -> None:
    body, found = solved(1.0, 0.49, friction=0.5)
    check(body, found)
    touch = found.last.touches[0]
    across = touch.traction - np.einsum("mi,mi->m", touch.traction, touch.normal)[:, None] * touch.normal
    assert (np.linalg.norm(across, axis=1) <= 0.5 * touch.pressure * (1 + 1e-3) + 1e-9).all()
    assert touch.sticking[touch.active].any()


def test_action_is_reaction_to_a_millionth() -> None:
    """Forces on the nodes of either body, and what holds them, with residuals to match."""
    body, held = balls(1.0, 0.3, 4, 3)
    found = press(body, held, [Pair("a.outer", "b.outer", friction=0.3)], times=(0.5, 1.0), tolerance=1e-7)
    lower = np.isin(np.arange(len(body.mesh.nodes)), body.mesh.node_set("a"))
    touch = found.last.touches[0]
    size = np.linalg.norm(touch.force)
    for half, sign in ((lower, 1.0), (~lower, -1.0)):
        np.testing.assert_allclose(touch.nodal[half].sum(axis=0), sign * touch.force, rtol=0, atol=1e-12 * size)
        np.testing.assert_allclose(
            found.last.reactions[half].sum(axis=0), -sign * touch.force, rtol=0, atol=1e-6 * size
        )


@pytest.mark.slow
def test_the_same_run_twice_is_the_same_bit_by_bit() -> None:
    runs = []
    for _ in range(2):
        body, held = balls(1.0, 0.45, 4, 3)
        runs.append(press(body, held, [Pair("a.outer", "b.outer", friction=0.4)], times=(0.5, 1.0)))
    for one, other in zip(runs[0].instants, runs[1].instants, strict=True):
        assert one.displacement.tobytes() == other.displacement.tobytes()
        assert one.reactions.tobytes() == other.reactions.tobytes()
        assert one.touches[0].traction.tobytes() == other.touches[0].traction.tobytes()
