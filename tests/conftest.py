"""Shared fixtures. Real assets are optional: tests that want them are skipped where the folder is missing."""

from __future__ import annotations

import gc
import os
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from tests.glb_files import hand_glb, write_glb  # noqa: F401
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig

if TYPE_CHECKING:
    from warpjld.covering import Covering

_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"

# bindings, hands and meshes of flesh are kept for this run of the tests and shared by its workers: each is made once by
# the code under test, and nothing that was made before counts
if "PYTEST_XDIST_WORKER" not in os.environ:
    _KEPT = tempfile.TemporaryDirectory(prefix="warpjld-tests-")
    os.environ["WARPJLD_CACHE"] = _KEPT.name

# how long an example takes is the machine's and its other users' affair
settings.register_profile("warpjld", deadline=None)
settings.load_profile("warpjld")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests may take as long as they like."""
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.timeout(0))


# what is imported and collected stays for the whole run: looking for circles among half a million objects again and
# again is a tenth of the collection's time
def pytest_collection(session: pytest.Session) -> None:
    if not session.config.getoption("numprocesses", None):  # else others collect
        gc.disable()


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def data() -> Path:
    """Folder of third-party assets."""
    if not _DATA.is_dir():
        pytest.skip("third-party assets (../shared/data) are not here")
    return _DATA


@pytest.fixture(scope="session")
def hands() -> dict[str, Rig]:
    """Built-in hands by side, coarse."""
    return {side: _built(side, resolution=1500) for side in ("left", "right")}


@pytest.fixture(scope="session")
def figure() -> Rig:
    """The built-in body."""
    from warpjld.hand.figure import build_body

    return build_body()


@pytest.fixture(scope="session")
def bound(hands: dict[str, Rig]) -> Covering:
    """The coarse left hand, bound."""
    from warpjld.covering.kept import bind_kept

    return bind_kept(hands["left"])[0]


@pytest.fixture
def quick_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Built-in hands are built once a session: what a test does with them is not what building them costs."""
    from warpjld.hand import kept

    monkeypatch.setattr(kept, "kept_hand", _built)


@cache
def _built(side: str, **options: float) -> Rig:
    return kept_hand(side, **options)
