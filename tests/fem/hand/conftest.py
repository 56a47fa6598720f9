"""One flesh hand for all tests of its package."""

from __future__ import annotations

import pytest

from warpjld.fem.hand import FleshHand, build_flesh_hand


@pytest.fixture(scope="session")
def hand() -> FleshHand:
    from warpjld.hand.kept import kept_hand

    return build_flesh_hand(kept_hand("left", resolution=4000), 0.003)
