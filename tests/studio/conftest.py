"""A studio and a real browser, once for all tests of a session."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from warpjld.studio.document import ScriptDocument
from warpjld.studio.opening import opened_document
from warpjld.studio.room import Room

_FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium with WebGL in software; tests that want it are skipped where there is none."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = os.environ.get("WARPJLD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        pytest.skip("there is no chromium on this machine")
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=found, args=_FLAGS)
        yield chromium
        chromium.close()


WAVE = "HAND LEFT BUILTIN RESOLUTION 1500\nJOINT left.index.base FLEXION AT 0 0\n"
"""A small hand, and a key."""


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """That as a file."""
    path = tmp_path / "wave.jld"
    path.write_text(WAVE)
    return path


@pytest.fixture
def room(script: Path) -> Iterator[Room]:
    """A studio with that script."""
    pytest.importorskip("viser", reason="viser is not installed")
    made = Room(opened_document(script, script.parent / "out"), port=0)
    yield made
    made.stop()


class Window:
    """A page of a studio in the browser."""

    def __init__(self, page: Any, room: Room) -> None:
        self.page, self.room = page, room
        page.set_default_timeout(60_000)  # a machine that does much else beside is no fault
        page.goto(room.address)
        self._drawn()

    def reload(self) -> None:
        """Load the page anew."""
        self.page.reload()
        self._drawn()

    def _drawn(self) -> None:
        # the hint that WebGL is computed in software comes and goes over the canvas
        self.page.add_style_tag(content=".mantine-Notifications-root, .mantine-Notification-root {display: none}")
        self.page.get_by_text("Joints", exact=True).wait_for()
        widths = [-1]

        def laid_out() -> bool:
            widths.append(int(self.page.get_by_role("tab", name="Pose", exact=True).bounding_box()["x"]) - 30)
            return widths[-1] == widths[-2] and self.fine()

        until(laid_out, "the panels are where they belong")
        self._width = widths[-1]
        until(lambda: self.skin() > 1000, "the hand is drawn")

    def pixels(self) -> np.ndarray:
        """The stage, left of the panels, shape (H, W, 3)."""
        height = self.page.viewport_size["height"]
        shot = self.page.screenshot(clip={"x": 0, "y": 0, "width": self._width, "height": height})
        return np.asarray(Image.open(BytesIO(shot)).convert("RGB"), np.int16)

    def still(self) -> np.ndarray:
        """The canvas when all that was asked for is drawn."""
        assert self.room.worker.settle()
        seen = [self.pixels()]

        def same() -> bool:
            fine = self.fine()  # before the picture is taken: else it may be the last coarse one
            seen.append(self.pixels())
            return fine and bool(np.array_equal(seen[-1], seen[-2]))

        until(same, "the canvas is still")
        return seen[-1]

    def fine(self) -> bool:
        """Whether the canvas has the resolution of a view at rest, by ``page.software_drawing``."""
        size = "(() => {const c = document.querySelector('canvas[data-engine]'); return [c.width, c.clientWidth]})()"
        width, shown = self.page.evaluate(size)
        return bool(width > 1.2 * shown)

    def skin(self) -> int:
        """How many pixels are reddish, as skin is."""
        pixels = self.pixels()
        return int((pixels[..., 0] > pixels[..., 2] + 15).sum())

    def changed(self, before: np.ndarray) -> int:
        """How many pixels differ clearly from those."""
        return int((np.abs(self.pixels() - before).max(axis=-1) > 20).sum())

    def control(self, label: str) -> Any:
        """The control with that label, in an open folder."""
        name = self.page.locator("label", has_text=re.compile(f"^{label}$")).locator("visible=true").first
        return self.page.locator(f'[id="{name.get_attribute("for")}"]')

    def drag_slider(self, label: str, share: float) -> float:
        """Drag a slider with the mouse to a share of its way; the value it shows then."""
        control = self.control(label)
        control.scroll_into_view_if_needed()
        thumb, track = control.get_by_role("slider"), control.locator(".mantine-Slider-track")
        here, way = thumb.bounding_box(), track.bounding_box()
        mouse = self.page.mouse
        mouse.move(here["x"] + here["width"] / 2, here["y"] + here["height"] / 2)
        mouse.down()
        mouse.move(way["x"] + share * way["width"], way["y"] + way["height"] / 2, steps=8)
        mouse.up()
        seen = [""]

        def stays() -> bool:
            assert self.room.worker.settle()
            seen.append(thumb.get_attribute("aria-valuenow"))
            return seen[-1] == seen[-2]

        until(stays, "the slider stays where it was let go")
        return float(seen[-1])

    def at(self, place: np.ndarray) -> tuple[float, float]:
        """Where a place on the stage [m] is seen [pixels]."""
        (client,) = self.room.server.get_clients().values()
        camera = client.camera
        ahead = np.asarray(camera.look_at) - np.asarray(camera.position)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, (0.0, 1.0, 0.0))
        right /= np.linalg.norm(right)
        way = np.asarray(place) - np.asarray(camera.position)
        box = self.page.locator("canvas").last.bounding_box()
        scale = box["height"] / 2.0 / np.tan(camera.fov / 2.0) / (way @ ahead)
        return (
            float(box["x"] + box["width"] / 2.0 + scale * (way @ right)),
            float(box["y"] + box["height"] / 2.0 - scale * (way @ np.cross(right, ahead))),
        )

    def press(self, name: str) -> None:
        """Press a button."""
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def tab(self, name: str) -> None:
        """Show a tab."""
        self.page.get_by_role("tab", name=name, exact=True).click()


def until(holds: Callable[[], bool], what: str, timeout: float = 60.0) -> None:
    """Wait for a condition; fail naming it where it does not come."""
    end = time.monotonic() + timeout
    while not holds():
        assert time.monotonic() < end, f"in {timeout:g} s it did not come about that {what}"


@pytest.fixture(scope="module")
def studio(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    """One studio and one page of it for all tests of a module."""
    pytest.importorskip("viser", reason="viser is not installed")
    script = tmp_path_factory.mktemp("studio") / "wave.jld"
    script.write_text(WAVE)
    room = Room(opened_document(script, script.parent / "out"), port=0)
    page = browser.new_page(viewport={"width": 900, "height": 800})
    yield Window(page, room)
    page.close()
    room.stop()


@pytest.fixture
def window(studio: Window) -> Window:
    """That page, with the script as it was at first."""
    room, path = studio.room, studio.room.state.document.path
    room.state.messages.clear()
    room.post(lambda: room.state.open(ScriptDocument(path, WAVE)))
    assert room.worker.settle()
    studio.page.mouse.move(5, 5)
    studio.tab("Pose")
    return studio
