"""Pictures of the studio for the documentation, taken in Chromium.

python docs/make_studio_pictures.py [NAME …] [--into FOLDER]     # into docs/pictures/, minutes

Without names those of the documentation; the others are of single panels, to be looked at.
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
from warpjld.script.menus import MENUS
from warpjld.studio.opening import opened_document
from warpjld.studio.room import Room

PICTURES = Path(__file__).resolve().parent / "pictures"
SIZE = {"width": 1180, "height": 820}
FLAGS = ["--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader"]

CURL = "HAND LEFT BUILTIN\nPOSE LEFT RELAXED 0\nPOSE LEFT FIST 20\n"
BALL = "HAND LEFT BUILTIN RESOLUTION 1500\nOBJECT BALL1 BALL 0.065 AT 0 0.1 0\n"
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


def pose(page: Any, room: Room) -> None:
    """A joint selected, ghosts of the keys around."""
    room.post(lambda: setattr(room.state, "frame", 11.0))
    page.get_by_label("Ghosts of neighbouring keys", exact=True).check()
    room.post(lambda: room.selected.select("left.index.knuckle2"))


def library(page: Any, room: Room) -> None:
    """Pictures of the poses."""
    page.get_by_text("Poses", exact=True).click()
    page.get_by_role("button", name="Pictures of the poses").click()
    page.get_by_role("button", name="Cancel").wait_for()
    page.get_by_role("button", name="Cancel").wait_for(state="hidden")
    page.get_by_role("button", name="Save pose").scroll_into_view_if_needed()


def grasps(page: Any, room: Room) -> None:
    """Ways to take a ball."""
    room.post(lambda: setattr(room.things.which, "value", "BALL1"))
    page.get_by_text("Objects", exact=True).last.click()
    page.get_by_role("button", name="auto", exact=True).click()
    page.get_by_role("button", name="Take it this way").wait_for(timeout=600_000)
    page.get_by_role("button", name="Cancel").wait_for(state="hidden", timeout=600_000)
    page.get_by_role("button", name="Take it this way").scroll_into_view_if_needed()


def script(page: Any, room: Room) -> None:
    """The script, with a fault."""
    page.get_by_role("tab", name="Script", exact=True).click()
    room.post(lambda: room.state.write(CURL + "JOINT left.index.base FLEXION AT 0 400\n"))
    page.locator("#studio-error").wait_for()


def keys(page: Any, room: Room) -> None:
    """The curve of a channel."""
    page.get_by_role("tab", name="Keys", exact=True).click()
    room.post(lambda: setattr(room.panels[-3].channel, "value", "left.index.base.flexion"))


def menu(page: Any, room: Room) -> None:
    """A form over the stage."""
    page.get_by_role("tab", name="Menus", exact=True).click()
    page.get_by_text("Grasp", exact=True).last.click()
    page.get_by_role("button", name="GRASP", exact=True).first.click()
    page.get_by_role("dialog").wait_for()


def menus(page: Any, room: Room) -> None:
    """Every menu, expanded."""
    page.get_by_role("tab", name="Menus", exact=True).click()
    for name in MENUS:
        page.get_by_text(name, exact=True).last.click()


def skin(page: Any, room: Room) -> None:
    """Objects and parameters of the skin, expanded."""
    page.get_by_text("Objects", exact=True).last.click()
    page.get_by_text("Skin at a joint", exact=True).click()
    page.get_by_text("Skin at a joint", exact=True).scroll_into_view_if_needed()


def work(page: Any, room: Room) -> None:
    """Files and jobs."""
    page.get_by_role("tab", name="Work", exact=True).click()


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
        "pose": (CURL, pose),
        "library": (CURL, library),
        "grasps": (BALL, grasps),
        "script": (CURL, script),
        "keys": (CURL, keys),
        "menus": (CURL, menus),
        "skin": (BALL, skin),
        "work": (CURL, work),
        "studio_press": (PLATE, press),
    }
    names = sys.argv[1:]
    into = PICTURES
    if "--into" in names:
        at = names.index("--into")
        into = Path(names[at + 1])
        del names[at : at + 2]
    documented = [name for name in shots if name.startswith("studio")]
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for name in names or documented:
            text, prepare = shots[name]
            path = Path(folder) / name / "hand.jld"  # what one leaves unsaved, the next does not find
            path.parent.mkdir()
            path.write_text(text)
            room = Room(opened_document(path, Path(folder) / "out"), port=0)
            page = browser.new_page(viewport=SIZE)
            page.set_default_timeout(300_000)  # a busy machine without a graphics card takes its time
            page.goto(room.address)
            page.get_by_text("Joints", exact=True).wait_for()
            page.get_by_text("Software WebGL").first.wait_for()
            page.locator(".mantine-Notification-closeButton").first.click()
            prepare(page, room)
            room.worker.settle()
            page.wait_for_timeout(4000)  # software WebGL draws when it can
            page.wait_for_function(
                "(c => c.width > 1.2 * c.clientWidth)(document.querySelector('canvas[data-engine]'))"
            )
            page.wait_for_timeout(1000)
            shot = Image.open(BytesIO(page.screenshot())).convert("RGB")
            shot.save(into / f"{name}.jpg", quality=80, optimize=True)
            page.close()
            room.stop()
        browser.close()


if __name__ == "__main__":
    main()
