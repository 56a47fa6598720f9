"""A body against itself: a strip bent until its ends meet, parts of it that never meet, and the same as two bodies
(R126, R127)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.errors import InputError
from warpjld.fem import Body, HexMesh, NeoHooke, Prescribed, box_hexes, prescribe
from warpjld.fem.contact import ContactSolution, Exclusion, Pair, press

LENGTH, THICK, ALONG = 0.12, 0.004, 48


@cache
def bent() -> Body:
    return Body(box_hexes((LENGTH, 0.012, THICK), (ALONG, 3, 2)), NeoHooke(1e5, 0.4))


@pytest.fixture(scope="module")
def strip() -> Body:
    return bent()


def upper(body: Body, never: bool, *, backwards: bool = False) -> tuple[np.ndarray, Exclusion]:
    """The strip's upper side in six parts along it; a part never meets itself and its neighbours (or any other).

    Of two parts the one with the lower label is the slave: backwards it is the other."""
    faces = body.mesh.face_set("z+")
    middle = body.mesh.nodes[body.mesh.quads(faces)].mean(axis=1)[:, 0]
    label = np.minimum((6 * middle / LENGTH).astype(np.int32), 5)
    label = 5 - label if backwards else label
    apart = np.abs(np.subtract.outer(np.arange(6), np.arange(6)))
    return faces, Exclusion(label, label, apart >= 0 if never else apart <= 1)


def folded(body: Body, time: float) -> Prescribed:
    """Up to time 1 the middle third is bent to a half circle, the ends turning by 90° each; then the ends are pushed
    together by their outer sides, until they must be squeezed by 15 %."""
    at = body.mesh.nodes
    third = LENGTH / 6.0
    bend = 0.5 * np.pi * min(time, 1.0) / third
    known = []
    for end, sign in ((at[:, 0] < 0.1 * LENGTH, -1.0), (at[:, 0] > 0.9 * LENGTH, 1.0)):
        nodes = np.flatnonzero(end & (at[:, 2] == 0.0))
        along = np.abs(at[nodes, 0] - 0.5 * LENGTH) - third
        angle = bend * third
        across = at[nodes, 2] - 0.5 * THICK
        place = at[nodes].copy()
        out = np.sin(angle) / bend + along * np.cos(angle) - across * np.sin(angle)
        place[:, 2] = (1.0 - np.cos(angle)) / bend + along * np.sin(angle) + across * np.cos(angle) + 0.5 * THICK
        together = max(0.0, time - 1.0) * (2.0 * third / np.pi - 0.35 * THICK)
        place[:, 0] = 0.5 * LENGTH + sign * (out - together)
        known.append(prescribe(body.mesh, nodes, displacement=place - at[nodes]))
    return known[0] + known[1]


TIMES = np.r_[np.arange(1, 9) / 8, 1.0 + np.arange(1, 9) / 8]


@cache
def touching(friction: float, backwards: bool = False) -> ContactSolution:
    """The strip folded until it touches itself."""
    strip = bent()
    faces, exclusion = upper(strip, never=False, backwards=backwards)
    pair = Pair(faces, faces, friction=friction, exclusion=exclusion)
    return press(strip, lambda t: folded(strip, t), [pair], times=TIMES)


def test_a_strip_folded_on_itself_touches_itself(strip: Body) -> None:
    found = touching(0.2)
    touches = [instant.touches[0] for instant in found.instants]
    assert all(touch.normal_force == 0.0 for touch in touches[:10])
    last = touches[-1]
    assert last.normal_force > 0.0
    assert last.penetration <= 1e-3 * LENGTH / ALONG
    at = strip.mesh.nodes + found.last.displacement
    left, right = (strip.mesh.nodes[:, 0] < 0.5 * LENGTH), (strip.mesh.nodes[:, 0] > 0.5 * LENGTH)
    # it does not pass through itself: gaps vanish in the mean of a node's surroundings, at the border not at each node
    assert at[left, 0].max() < at[right, 0].min() + 0.1 * LENGTH / ALONG
    np.testing.assert_allclose(last.nodal.sum(axis=0), 0.0, atol=1e-12 * last.normal_force)
    np.testing.assert_allclose(last.nodal[left].sum(axis=0)[0], -last.normal_force, rtol=2e-2)


def test_what_is_excluded_passes(strip: Body) -> None:
    faces, exclusion = upper(strip, never=True)
    found = press(strip, lambda t: folded(strip, t), [Pair(faces, faces, exclusion=exclusion)], times=TIMES)
    assert all(instant.touches[0].normal_force == 0.0 for instant in found.instants)
    at = strip.mesh.nodes + found.last.displacement
    left = strip.mesh.nodes[:, 0] < 0.5 * LENGTH
    assert at[left, 0].max() > at[~left, 0].min() + 0.1 * THICK


def test_self_contact_without_parts_is_refused(strip: Body) -> None:
    faces, _ = upper(strip, never=False)
    with pytest.raises(InputError, match="self-contact needs an exclusion"):
        press(strip, folded(strip, 0.1), [Pair(faces, faces)])


@pytest.mark.parametrize("friction", [0.2, *(pytest.param(f, marks=pytest.mark.slow) for f in (0.0, 0.5))])
def test_it_does_not_matter_which_side_is_the_slave(friction: float) -> None:
    forces = []
    for backwards in (False, True):
        found = touching(friction, backwards)
        forces.append([float(np.linalg.norm(instant.touches[0].force)) for instant in found.instants])
    assert forces[0][-1] > 0.0
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-2, atol=2e-3 * forces[0][-1])


def askew(turned: bool) -> list[ContactSolution]:
    """Two soft lumps pressed together askew, so that they slide and roll: one pair "self", and one between the two, the
    lower the slave or, turned, the upper."""
    lumps = {
        name: named(bulging(box_hexes((0.02, 0.02, 0.01), (count, count, 3)), sign), name, at)
        for name, count, sign, at in (("a", 6, 1.0, (0.0, 0.0, -0.01)), ("b", 5, -1.0, (0.002, 0.001, 0.004)))
    }
    body = together({name: (lump, NeoHooke(1e5, 0.45)) for name, lump in lumps.items()})
    low = prescribe(body.mesh, "a.z-", x=0.0, y=0.0, z=0.0)

    def held(time: float) -> Prescribed:
        return low + prescribe(body.mesh, "b.z+", x=-0.002 * time, y=0.001 * time, z=-0.0025 * time)

    one, other = body.mesh.face_set("a.z+"), body.mesh.face_set("b.z-")
    both = np.concatenate([one, other])
    label = np.repeat(np.array([0, 1], np.int32), [len(one), len(other)])
    itself = Pair(both, both, 0.3, exclusion=Exclusion(label, label, np.eye(2, dtype=bool)))
    times = np.linspace(0.1, 1.0, 10)
    two = Pair("b.z-", "a.z+", 0.3) if turned else Pair("a.z+", "b.z-", 0.3)
    return [press(body, held, [pair], times=times) for pair in (itself, two)]


def forces(solution: ContactSolution) -> np.ndarray:
    return np.array([instant.touches[0].force for instant in solution.instants])


@pytest.mark.slow
def test_as_one_pair_with_itself_or_as_two_bodies_whichever_is_the_slave() -> None:
    itself, two = (forces(solution) for solution in askew(turned=True))
    np.testing.assert_allclose(-two, itself, rtol=0, atol=2e-2 * np.abs(itself).max())


def test_as_one_pair_with_itself_or_as_two_bodies() -> None:
    found = askew(turned=False)
    itself, two = (forces(solution) for solution in found)
    np.testing.assert_allclose(itself, two, rtol=1e-3, atol=1e-3 * np.abs(itself).max())
    assert np.median(found[0].steps) <= 7
    assert len(found[0].steps) == len(found[0].instants)
    last = found[0].last.touches[0]
    assert last.peak > 0.2e5  # pressure as high as the flesh is stiff makes directions matter
    np.testing.assert_allclose(last.nodal.sum(axis=0), 0.0, atol=1e-12 * last.normal_force)


def bulging(mesh: HexMesh, sign: float) -> HexMesh:
    """A block with a side that bulges by 3 mm, the upper one (1) or the lower one (−1)."""
    nodes = mesh.nodes.copy()
    middle = nodes[:, :2] - 0.01
    share = nodes[:, 2] / 0.01 if sign > 0.0 else 1.0 - nodes[:, 2] / 0.01
    nodes[:, 2] += sign * share * (0.003 - 15.0 * (middle**2).sum(axis=1))
    nodes[:, :2] -= 0.01
    return replace(mesh, nodes=nodes)
