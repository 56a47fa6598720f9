"""A body against itself: a strip bent until its ends meet, and parts of it that never meet (R126, R127)."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Body, NeoHooke, Prescribed, box, prescribe
from warpjld.fem.contact import Exclusion, Pair, press

LENGTH, THICK, ALONG = 0.12, 0.004, 48


@pytest.fixture(scope="module")
def strip() -> Body:
    return Body(box((LENGTH, 0.012, THICK), (ALONG, 3, 2)), NeoHooke(1e5, 0.4))


def upper(body: Body, never: bool) -> tuple[np.ndarray, Exclusion]:
    """The strip's upper side in six parts along it; a part never meets itself and its neighbours (or any other)."""
    faces = body.mesh.face_set("z+")
    middle = body.mesh.nodes[body.mesh.quads(faces)].mean(axis=1)[:, 0]
    label = np.minimum((6 * middle / LENGTH).astype(np.int32), 5)
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


def test_a_strip_folded_on_itself_touches_itself(strip: Body) -> None:
    faces, exclusion = upper(strip, never=False)
    found = press(
        strip, lambda t: folded(strip, t), [Pair(faces, faces, friction=0.2, exclusion=exclusion)], times=TIMES
    )
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
    with pytest.raises(InputError, match="against itself wants an exclusion"):
        press(strip, folded(strip, 0.1), [Pair(faces, faces)])
