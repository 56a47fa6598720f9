"""Pictures of the studio for the documentation, taken in Chromium.

python docs/make_studio_pictures.py [NAME …]        # into docs/pictures/, about two minutes
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

from warpjld.runtime.quiet import silence_warp
from warpjld.studio.opening import opened_document
from warpjld.studio.room import Room

PICTURES = Path(__file__).resolve().parent / "pictures"
SIZE = {"width": 1180, "height": 820}
FLAGS = ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

CURL = "HAND LEFT BUILTIN\nPOSE LEFT RELAXED 0\nPOSE LEFT FIST 20\n"
PLATE = """HAND LEFT BUILTIN
FRAMES 0 20
OBJECT PLATE BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165
MOVE LEFT 0 0 0.003 0
MOVE LEFT 20 0 -0.0063 0
FLESH LEFT INDEX ELEMENT 0.003
PRESS 0 20 EVERY 4
"""


def curl(page: Any, room: Room) -> None:
    """A hand half closed."""
    room.post(lambda: setattr(room.state, "frame", 11.0))


def menu(page: Any, room: Room) -> None:
    """A form over the stage."""
    page.get_by_role("tab", name="Menus", exact=True).click()
    page.get_by_text("Grasp", exact=True).last.click()
    page.get_by_role("button", name="GRASP", exact=True).first.click()
    page.get_by_role("dialog").wait_for()


def press(page: Any, room: Room) -> None:
    """Pressure on a fingertip, seen from below."""
    page.get_by_role("tab", name="Work", exact=True).click()
    page.get_by_role("button", name="PRESS: solve contact").click()
    page.locator("#studio-verdict").wait_for(timeout=600_000)
    room.post(lambda: setattr(room.state, "frame", 20.0))
    page.get_by_role("tab", name="Pose", exact=True).click()
    page.get_by_label("Objects", exact=True).uncheck()
    page.get_by_role("tab", name="Work", exact=True).click()
    for client in room.server.get_clients().values():
        with client.atomic():
            client.camera.position, client.camera.look_at = (0.07, -0.14, -0.24), (0.02, -0.015, -0.13)


def main() -> None:
    """Take those that are named, or all."""
    silence_warp()
    shots: dict[str, tuple[str, Callable[[Any, Room], None]]] = {
        "studio": (CURL, curl),
        "studio_menu": (CURL, menu),
        "studio_press": (PLATE, press),
    }
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for name in sys.argv[1:] or shots:
            text, prepare = shots[name]
            script = Path(folder) / "hand.jld"
            script.write_text(text)
            room = Room(opened_document(script, Path(folder) / "out"), port=0)
            page = browser.new_page(viewport=SIZE)
            page.goto(room.address)
            page.get_by_text("Joints", exact=True).wait_for()
            page.get_by_text("Software WebGL").first.wait_for()
            page.locator(".mantine-Notification-closeButton").first.click()
            prepare(page, room)
            room.worker.settle()
            page.wait_for_timeout(4000)  # software WebGL draws when it can
            shot = Image.open(BytesIO(page.screenshot())).convert("RGB")
            shot.save(PICTURES / f"{name}.jpg", quality=80, optimize=True)
            page.close()
            room.stop()
        browser.close()


if __name__ == "__main__":
    main()
