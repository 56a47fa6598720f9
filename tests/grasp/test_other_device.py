"""Closing, distances and placements on another device: nothing is launched on, or read from, the wrong one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.grasp.other_device import pretend
from warpjld.covering import Covering
from warpjld.grasp import distance
from warpjld.grasp.close import Closer
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.placements import sample_wrists
from warpjld.grasp.postures import posture_angles
from warpjld.grasp.shapes import ball
from warpjld.grasp.widths import sample_widths


@pytest.fixture
def there(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The other device; skins are deformed on the CPU, whatever is asked for."""
    device = pretend(monkeypatch)
    known, deform = distance.checked_device, Covering.deform
    monkeypatch.setattr(distance, "checked_device", lambda name: device if name == str(device) else known(name))

    def on_cpu(self: Covering, *poses: Any, **how: Any) -> Any:
        return deform(self, *poses, **(how | {"device": "cpu"}))

    monkeypatch.setattr(Covering, "deform", on_cpu)
    return device


def test_hands_close_as_on_the_cpu(there: Any, bound: Covering) -> None:
    thing = ball(0.05, subdivisions=3)
    angles = posture_angles(bound.skeleton, "left", "sphere")
    found = []
    for device in ("cpu", str(there)):
        near = NearObject(thing, device)
        widths = sample_widths(near, 40, np.random.default_rng(0), widest=0.1)
        hands = sample_wrists(bound, angles, near, "left", 2, np.random.default_rng(0))
        closer = Closer(bound, thing, near)
        how = {"coupling": (1.0, 0.7), "apart": False}
        closed = closer.close(hands.poses(bound.skeleton), hands.angles, **how)
        quick = closer.close(hands.poses(bound.skeleton), hands.angles, quick=True, **how)
        near_skin = near.near(widths.first, 1e-3)
        found.append([widths.first, widths.second, hands.position, near_skin.point, near_skin.distance])
        found[-1] += [value for one in (closed, quick) for value in (one.angles, one.status, one.gap, one.penetration)]
    for here, elsewhere in zip(*found, strict=True):
        np.testing.assert_array_equal(here, elsewhere)
    assert closed.touching().any()
    wanted = {"follow_through", "come_near", "first_touch", "least_by_part", "measure_near"}
    assert wanted <= there.launched
    assert {"least_opening", "distances_at"} <= there.launched
