"""Penetration of shapes whose depth and volume are known."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.quality import penetration
from warpjld.grasp.shapes import ball, box
from warpjld.rig import Rig


def test_a_corner_between_skin_vertices_is_found_from_its_own_side(rig: Rig, covering: Covering) -> None:
    """A box whose corner lies inside the palm holds no skin vertex there, or a less deep one."""
    skin = rig.surface.vertices.astype(np.float32)
    middle = 0.5 * (
        rig.skeleton.rest[rig.skeleton.index("wrist")] + rig.skeleton.rest[rig.skeleton.index("middle.base")]
    )
    away = penetration(HandObjectGaps(covering, ball(0.03).placed(middle + np.array([0.0, 0.2, 0.0]))), skin)
    assert (away.depth, away.volume) == (0.0, 0.0)
    inner = ball(0.008, subdivisions=3).placed(middle)  # swallowed: no skin vertex is inside it
    swallowed = penetration(HandObjectGaps(covering, inner), skin)
    assert swallowed.skin == 0.0
    assert swallowed.thing > 0.008 / 2.0
    assert swallowed.volume == pytest.approx(np.pi / 6.0 * 0.008**3, rel=0.05)
    palm = skin[np.linalg.norm((skin - middle)[:, [0, 2]], axis=1) < 0.01][:, 1].min()
    slab = box(0.3, 0.02, 0.3).placed([0.0, palm + 0.002 - 0.01, 0.0])  # its top is 2 mm above the palm's skin
    assert penetration(HandObjectGaps(covering, slab), skin).skin >= 0.0019


def test_blocks_that_are_left_out_hold_nothing_of_a_volume(
    rig: Rig, covering: Covering, monkeypatch: pytest.MonkeyPatch
) -> None:
    intersection = import_module("warpjld.grasp.intersection")  # the package has a function of that name
    skin = rig.surface.vertices.astype(np.float32)
    middle = rig.skeleton.rest[rig.skeleton.index("middle.base")]
    turn = Rotation.from_rotvec([0.3, 0.2, 0.1]).as_quat()
    things = [ball(0.05, subdivisions=3).placed(middle), box(0.03, 0.06, 0.02).placed(middle, turn)]
    found = [intersection.intersection(covering, skin, thing) for thing in things]
    tested = []

    def everything(posed: object, skin: object, near: object, axes: list[np.ndarray], h: float) -> np.ndarray:
        tested.append(original(posed, skin, near, axes, h).mean())
        return np.ones([len(axis) for axis in axes], dtype=bool)

    original = intersection._overlap
    monkeypatch.setattr(intersection, "_overlap", everything)
    assert [one.volume for one in found] == [
        intersection.intersection(covering, skin, thing).volume for thing in things
    ]
    assert min(one.volume for one in found) > 1e-7
    assert max(tested) < 0.9
