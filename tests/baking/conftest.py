"""A small hand with its covering, baked once."""

from __future__ import annotations

import pytest

from warpjld.baking import Baked, bake, training_poses
from warpjld.covering import Covering
from warpjld.rig import Rig


@pytest.fixture(scope="session")
def covering(bound: Covering) -> Covering:
    return bound


@pytest.fixture(scope="session")
def baked(covering: Covering, hands: dict[str, Rig]) -> Baked:
    rig = hands["left"]
    return bake(rig, covering, training_poses(rig.skeleton), correctives=16)
