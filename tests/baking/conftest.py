"""A small hand with its covering, baked once."""

from __future__ import annotations

import pytest

from warpjld.baking import Baked, bake, training_poses
from warpjld.covering import Covering, bind_rig
from warpjld.hand import build_hand


@pytest.fixture(scope="session")
def covering() -> Covering:
    return bind_rig(build_hand("left", resolution=1500))


@pytest.fixture(scope="session")
def baked(covering: Covering) -> Baked:
    rig = build_hand("left", resolution=1500)
    return bake(rig, covering, training_poses(rig.skeleton), correctives=16)
