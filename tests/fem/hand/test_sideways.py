"""Moments about the axis of abduction, against forces that turn digits by known angles."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.sideways import sideways_shares
from warpjld.hand.kept import kept_hand
from warpjld.skeleton.channels import ABDUCTION
from warpjld.skeleton.kinematics import poses_from_angles


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("digit", "strength"), [("index", 59.0 * 42.4 / 235.0), ("thumb", 69.0)])
def test_a_force_against_the_motion_of_the_pad_is_borne_up_to_the_limit(side: str, digit: str, strength: float) -> None:
    skeleton = kept_hand(side, resolution=4000).skeleton
    base, last, tip = (skeleton.index(f"{side}.{digit}.{name}") for name in ("base", "knuckle3", "tip"))
    turned = np.zeros((2, len(skeleton), 4))
    turned[1, base, ABDUCTION] = 1e-4
    poses = poses_from_angles(skeleton, turned)
    pad = 0.5 * (poses.positions[:, last] + poses.positions[:, tip])
    way = pad[1] - pad[0]  # of the pad as abduction increases
    lever = np.linalg.norm(skeleton.rest[[last, tip]].mean(axis=0) - skeleton.rest[base])
    across = np.linalg.norm(way) / 1e-4  # distance of the pad from the axis
    force = -strength * way / np.linalg.norm(way)
    loads = BoneLoads((tip,), force[None], np.cross(pad[0], force)[None])
    found = sideways_shares(skeleton, poses, loads)
    assert found[f"{side}.{digit}"] == pytest.approx(across / lever, rel=1e-3)
    assert found[f"{side}.middle"] == 0.0
    doubled = sideways_shares(skeleton, poses, loads, {digit: 2.0 * {"index": 59.0, "thumb": 69.0}[digit]})
    assert doubled[f"{side}.{digit}"] == pytest.approx(0.5 * found[f"{side}.{digit}"])
