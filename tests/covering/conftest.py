"""Rigs and poses that the tests of the covering share."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.io import load_rig
from warpjld.rig import Rig


@pytest.fixture(scope="session")
def built(hands: dict[str, Rig]) -> Rig:
    """The built-in left hand, coarse."""
    return hands["left"]


@pytest.fixture(scope="session")
def webxr_hands(data: Path) -> dict[str, Rig]:
    """Both WebXR generic hands."""
    return {side: load_rig(data / "hand_webxr_generic" / f"{side}.glb") for side in ("left", "right")}
