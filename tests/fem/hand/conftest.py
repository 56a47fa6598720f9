"""Flesh hands for all tests of their package."""

from __future__ import annotations

import pytest

from warpjld.fem.hand import FleshHand, build_flesh_hand


@pytest.fixture(scope="session")
def hand() -> FleshHand:
    from warpjld.hand.kept import kept_hand

    return build_flesh_hand(kept_hand("left", resolution=4000), 0.003)


@pytest.fixture(scope="session")
def coarse() -> FleshHand:
    """Of elements that are too large for the flesh over some bones."""
    from warpjld.hand.kept import kept_hand

    return build_flesh_hand(kept_hand("left", resolution=4000), 0.005)
