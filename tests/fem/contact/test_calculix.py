"""A ball between two plates, against CalculiX 2.20: whole forces at plate travels of 0.02 … 0.2 in all.

Radius 1, E = 1, no friction. CalculiX: full integration (C3D8), face-to-face penalty contact.

Contact radius: 0.309 and 0.465 (linear), 0.323 and 0.474 (rubber) are noted of CalculiX, not how they were taken.
They are 3 to 8 % less than its own force allows (Hertz: a³ = 3 F R / 4 E*), and less than ours goes to as the mesh is
refined (0.334 and 0.477, linear): an extent of contact elements that press, it seems, which stays behind the border.
The tests ask for no less than that, no more than half an edge beyond it, and for Hertz's radius to 3 %.

The hollow ball (inner radius 0.8, ν 0.45; CalculiX with neo-Hooke 0.0093 and 0.0206 at 0.1 and 0.2): with full
integration a thin shell is too stiff, with one pressure per element (ours) a little too soft. At small strain and 0.1
both go to the same 0.0110 as the mesh is refined, full integration from 7 % above on 8 × 8 × 2 elements a patch and
½ % above on 16 × 16 × 8, ours from 4 % and ½ % below. CalculiX, which is full, stands 5 % above what ours goes to with
neo-Hooke (0.00866, 0.00876, 0.00881 at 12 × 3, 16 × 4, 20 × 6): it is CalculiX's mesh that is too stiff there.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import lid, symmetric
from warpjld.fem import Body, LinearElastic, Material, NeoHooke, ball
from warpjld.fem.contact import ContactInstant, Pair, press

RUBBER = [0.00489, 0.01427, 0.02681, 0.04232, 0.06052, 0.08115, 0.10472, 0.13062, 0.15986, 0.19229]


def squeezed(
    law: Material, times: list[float], n: int, inner: float = 0.0, layers: int | None = None, travel: float = 0.2
) -> tuple[ContactInstant, ...]:
    """An octant; the plate comes down by half of what the two plates approach one another."""
    mesh = ball(1.0, inner=inner, n=n, layers=layers, octant=True)
    return press(Body(mesh, law), symmetric(mesh), [Pair("outer", lid(travel))], times=times).instants


def force(instant: ContactInstant) -> float:
    return 4.0 * instant.touches[0].normal_force


def check_radius(instant: ContactInstant, extent: float, edge: float, modulus: float) -> None:
    radius = np.sqrt(4.0 * instant.touches[0].contact_area / np.pi)
    assert extent < radius < extent + 0.5 * edge
    assert radius == pytest.approx((0.75 * force(instant) / modulus) ** (1 / 3), rel=0.03)


def test_solid_ball_linear() -> None:
    """2048 elements, as CalculiX."""
    half, whole = squeezed(LinearElastic(1.0, 0.3), [0.5, 1.0], 8)
    assert force(half) == pytest.approx(0.0544, rel=0.02)
    assert force(whole) == pytest.approx(0.1706, rel=0.02)
    check_radius(half, 0.309, 0.13, 1.0 / 0.91)
    check_radius(whole, 0.465, 0.13, 1.0 / 0.91)


@pytest.mark.slow
def test_solid_ball_of_rubber() -> None:
    """6912 elements, as CalculiX, ten increments."""
    instants = squeezed(NeoHooke(1.0, 0.45), [k / 10 for k in range(1, 11)], 12)
    np.testing.assert_allclose([force(instant) for instant in instants], RUBBER, rtol=0.02)
    assert instants[-1].touches[0].peak == pytest.approx(0.389, rel=0.02)
    check_radius(instants[4], 0.323, 0.09, 1.0 / (1.0 - 0.45**2))
    check_radius(instants[9], 0.474, 0.09, 1.0 / (1.0 - 0.45**2))


def test_solid_ball_of_rubber_in_three_steps() -> None:
    """The same body, coarser in time: without friction the way does not matter."""
    instants = squeezed(NeoHooke(1.0, 0.45), [0.2, 0.5, 1.0], 8)
    np.testing.assert_allclose([force(instant) for instant in instants], [RUBBER[1], RUBBER[4], RUBBER[9]], rtol=0.03)


@pytest.mark.slow
def test_hollow_ball_is_bracketed() -> None:
    found = {}
    for n, layers in ((8, 2), (16, 8)):
        for ours in (True, False):
            law = LinearElastic(1.0, 0.45, mean_dilatation=ours)
            found[n, ours] = force(squeezed(law, [0.5, 1.0], n, 0.8, layers, travel=0.1)[-1])
    assert found[8, True] < found[16, True] < found[16, False] < found[8, False]
    assert found[16, False] < 1.015 * found[16, True]
    assert found[8, False] > 1.10 * found[8, True]


@pytest.mark.slow
def test_hollow_ball_of_rubber() -> None:
    """Below CalculiX by what full integration is above the limit on such a mesh, and falling short by no more."""
    half, whole = squeezed(NeoHooke(1.0, 0.45), [0.25, 0.5, 0.75, 1.0], 16, 0.8, 4)[1::2]
    assert 0.94 * 0.0093 < force(half) < 0.0093
    assert 0.94 * 0.0206 < force(whole) < 0.0206
