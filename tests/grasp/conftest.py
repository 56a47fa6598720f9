"""A coarse hand for the tests of grasping."""

from __future__ import annotations

import pytest

from warpjld.covering import Covering
from warpjld.rig import Rig


@pytest.fixture(scope="session")
def rig(hands: dict[str, Rig]) -> Rig:
    return hands["left"]


@pytest.fixture(scope="session")
def covering(bound: Covering) -> Covering:
    return bound
