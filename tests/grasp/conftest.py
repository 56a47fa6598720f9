"""A coarse hand, bound, for the tests of grasping."""

from __future__ import annotations

import pytest

from warpjld.covering import Covering, bind
from warpjld.hand import build_hand
from warpjld.rig import Rig


@pytest.fixture(scope="session")
def rig() -> Rig:
    return build_hand("left", resolution=1500)


@pytest.fixture(scope="session")
def covering(rig: Rig) -> Covering:
    return bind(rig.skeleton, rig.surface)
