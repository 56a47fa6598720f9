"""The studio in a real browser: what the mouse does is seen, and is in the script."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.studio.conftest import Window, until
from warpjld.geometry.normals import vertex_normals
from warpjld.script import all_commands
from warpjld.script.plugin import load_commands
from warpjld.script.staging import stage
from warpjld.studio.reach_tips import tips
from warpjld.studio.state import StudioState

INDEX = "left.index.base.flexion"
SLOW = pytest.mark.slow
"""Tests that drag with the mouse wait for a browser that two cores share with other tests: now and then too long."""

TRICK = """
import warpjld as wj

@wj.menu("Pose/My trick")
@wj.command("TRICK", syntax="TRICK <LEFT/RIGHT> <key> [FAST]", help="Bend the index finger.")
def trick(scene, arguments):
    side = arguments.choice("the side", ("LEFT", "RIGHT"))
    key = arguments.number("the key")
    angle = 60 if arguments.keyword("FAST") else 30
    arguments.interpreter.run_text(f"FINGER1 {side} INDEX FLEXION AT {key} {angle}", "<TRICK>")
"""


@pytest.fixture(scope="module", autouse=True)
def trick(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A user's command is there, before the studio is."""
    path = tmp_path_factory.mktemp("commands") / "trick.py"
    path.write_text(TRICK)
    load_commands(path)
    yield
    all_commands().remove("TRICK")


def bend(state: StudioState) -> float:
    """The index's first angle; NaN while the script runs."""
    return state.angles().get(INDEX, math.nan)


@SLOW
def test_a_dragged_slider_bends_the_finger_on_screen_and_in_the_script(window: Window) -> None:
    before, state = window.still(), window.room.state
    angle = window.drag_slider("base flexion", 0.9)
    assert angle > 50
    until(lambda: window.changed(before) > 500, "the finger is drawn bent")
    until(lambda: abs(bend(state) - angle) < 0.1, "the state has it bent")
    assert state.document.text.splitlines()[-1].startswith("JOINT left.index.base FLEXION AT 0 ")
    window.tab("Script")
    shown = window.page.locator("textarea").first
    until(lambda: shown.input_value() == state.document.text, "the pane shows the script")
    window.press("undo")
    until(lambda: bend(state) == 0, "it is undone")
    until(lambda: window.changed(before) < 50, "the finger is drawn as before")


@SLOW
def test_a_key_is_set_scrubbed_past_and_deleted(window: Window) -> None:
    state = window.room.state
    frame = window.drag_slider("Frame", 0.5)
    assert 20 <= frame <= 28
    until(lambda: state.frame == frame, "the frame is shown")
    angle = window.drag_slider("base flexion", 0.95)
    assert angle > 60
    until(lambda: abs(bend(state) - angle) < 0.1, "a key is set there")
    assert state.keys == [0, state.frame]
    bent = window.still()
    window.drag_slider("Frame", 0.0)
    until(lambda: state.frame == 0, "the first frame is shown")
    until(lambda: window.changed(bent) > 500, "the finger is drawn straight there")
    straight = window.still()
    window.press("key ▸")
    until(lambda: state.frame == state.keys[-1], "the next key is shown")
    until(lambda: window.changed(straight) > 500, "the finger is drawn bent again")
    until(lambda: window.changed(bent) == 0, "it is drawn as when the key was set, pixel by pixel")
    window.press("delete")
    until(lambda: state.keys == [0], "the key is gone")
    assert state.document.text.splitlines()[-1] == f"KEYS DELETE {state.frame:g} LEFT"


def test_what_is_typed_is_done_and_a_fault_is_shown_at_its_line(window: Window) -> None:
    state = window.room.state
    window.tab("Script")
    pane = window.page.locator("textarea").first
    text = state.document.text
    pane.fill(f"{text}JOINT left.index.base FLEXION AT 0 400\n")
    error = window.page.locator("#studio-error")
    error.wait_for()
    assert "wave.jld:3:36: flexion of left.index.base goes from -45° to 90°, got 400°" in error.inner_text()
    pane.fill(f"{text}JOINT left.index.base FLEXION AT 0 40\n")
    error.wait_for(state="detached")
    assert round(bend(state)) == 40


def test_a_users_command_has_a_menu_entry_with_a_form(window: Window) -> None:
    state, page = window.room.state, window.page
    before = window.still()
    window.tab("Menus")
    page.get_by_text("Pose", exact=True).last.click()
    window.press("My trick")
    form = page.get_by_role("dialog")
    form.get_by_text("Bend the index finger.").wait_for()
    form.get_by_label("fast").check()
    line = form.locator("textarea").first
    until(lambda: line.input_value() == "TRICK LEFT 0 FAST", "the form shows its line")
    form.get_by_role("button", name="Do it").click()
    until(lambda: round(bend(state)) == 60, "the command is done")
    assert state.document.text.splitlines()[-1] == "TRICK LEFT 0 FAST"
    form.wait_for(state="detached")
    until(lambda: window.changed(before) > 500, "it is seen")


@SLOW
def test_two_windows_show_the_same_and_a_closed_one_or_a_reload_loses_nothing(window: Window, browser: Any) -> None:
    state, room = window.room.state, window.room
    page = browser.new_page(viewport={"width": 900, "height": 800})
    other = Window(page, room)
    before = other.still()
    angle = window.drag_slider("base flexion", 0.9)
    until(lambda: abs(bend(state) - angle) < 0.1, "a key is set there")
    until(lambda: other.changed(before) > 500, "the other window shows it")
    bent = window.still()
    page.close()
    window.reload()
    until(lambda: window.changed(bent) < 50, "it is as it was")
    value = window.control("base flexion").get_by_role("slider").get_attribute("aria-valuenow")
    assert abs(float(value) - bend(state)) < 0.5


@SLOW
@pytest.mark.parametrize("width", [700, 1300])
def test_the_first_view_shows_the_whole_hand_in_windows_narrow_and_wide(
    browser: Any, studio: Window, width: int
) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800})
    other = Window(page, studio.room)

    def inside() -> bool:
        pixels = other.pixels()
        skin = pixels[..., 0] > pixels[..., 2] + 15
        border = skin[:2].any() or skin[-2:].any() or skin[:, :2].any() or skin[:, -2:].any()
        return bool(skin.sum() > 1000 and not border)

    until(inside, "the hand is seen as a whole")
    page.close()


def test_the_page_asks_nothing_of_other_machines(browser: Any, studio: Window) -> None:
    page = browser.new_page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.goto(studio.room.address)
    page.get_by_text("Joints", exact=True).wait_for()
    page.close()
    host = studio.room.address.removeprefix("http://")
    assert len(asked) >= 2
    assert all(url.split("://")[-1].startswith(host.rstrip("/")) or url.startswith(("data:", "blob:")) for url in asked)


NORMALS = """() => {
  let found = null;
  const large = one => one.isMesh && one.geometry.attributes.normal?.count > 1000;
  __viserMutable.scene.traverse(one => { if (large(one)) found ??= one; });
  return [found.geometry.computeVertexNormals.toString().includes("area"), ...["position", "normal"].map(
    name => [...found.geometry.attributes[name].array])];
}"""


@SLOW
def test_the_pages_own_normals_are_those_of_the_surface(window: Window) -> None:
    state = window.room.state
    window.drag_slider("base flexion", 0.9)
    window.still()
    (shown,) = state.shown()
    ours, places, normals = window.page.evaluate(NORMALS)
    assert ours
    assert np.allclose(np.reshape(places, (-1, 3)), shown.vertices, atol=1e-6)
    wanted = vertex_normals(shown.vertices, shown.faces)
    assert np.abs(np.reshape(normals, (-1, 3)) - wanted).max() < 1e-3


COUNT_DRAWN = """() => {
  window.counted = {frames: 0, drawn: 0};
  let drawn = false;
  const original = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (...given) {
    drawn = true;
    return original.apply(this, given);
  };
  (function frame() {
    requestAnimationFrame(frame);
    counted.frames++;
    counted.drawn += drawn;
    drawn = false;
  })();
}"""


@SLOW
def test_while_a_slider_is_dragged_only_frames_with_news_are_drawn(window: Window) -> None:
    window.drag_slider("base flexion", 0.2)
    window.still()
    before = window.still()
    window.page.evaluate(COUNT_DRAWN)
    updates = []
    set_angles = window.room.state.set_angles
    window.room.state.set_angles = lambda *given, **named: (updates.append(1), set_angles(*given, **named))[1]
    window.drag_slider("base flexion", 0.9)
    window.still()
    counted = window.page.evaluate("counted")
    assert window.changed(before) > 300
    # a picture each update, and while the view comes to rest those of a quarter of a second
    assert 0 < counted["drawn"] <= len(updates) + 30
    assert counted["frames"] > counted["drawn"]


def index_tip(state: StudioState) -> np.ndarray:
    """Where the tip of the index is [m], shape (3,)."""
    assert state.actor is not None
    return stage(state.actor, np.array([state.frame]), state.scene.rate).positions[0][
        tips(state.actor, "left")["index"]
    ]


@SLOW
def test_a_click_selects_the_joint_and_a_dragged_fingertip_bends_its_finger(window: Window) -> None:
    state, room, mouse = window.room.state, window.room, window.page.mouse
    assert state.actor is not None
    joints = stage(state.actor, np.zeros(1), 30.0).positions[0]
    names = state.actor.skeleton.names
    middle = (joints[names.index("left.index.knuckle2")] + joints[names.index("left.index.knuckle3")]) / 2.0
    mouse.click(*window.at(middle))
    until(lambda: state.joint == "left.index.knuckle2", "the joint under the pointer is selected")
    assert room.worker.settle()
    before, tip = window.still(), index_tip(state)
    (handle,) = [one for name, one in room.server.scene._handle_from_node_name.items() if name == "/tip"]
    grip = tip + np.array([0.0, 0.6 * handle.scale, 0.0])
    mouse.move(*window.at(grip))
    mouse.down()
    mouse.move(*window.at(grip - np.array([0.0, 0.03, 0.0])), steps=6)
    mouse.up()
    until(lambda: np.linalg.norm(index_tip(state) - tip) > 0.01, "the tip is dragged away")
    assert room.worker.settle()
    lines = state.document.text.splitlines()[2:]
    assert lines
    assert all(line.startswith("JOINT left.index.") for line in lines)
    until(lambda: window.changed(before) > 300, "the finger is drawn bent")
    for name, degrees in state.angles().items():
        low, high = state.channels()[name]
        assert low <= degrees <= high
    room.post(lambda: room.state.undo())
    assert room.worker.settle()  # no actor is there while the scene is made anew
    until(lambda: np.linalg.norm(index_tip(state) - tip) < 1e-9, "it is undone in one step")


@SLOW
def test_a_dragged_wrist_moves_the_hand(window: Window) -> None:
    state, room, mouse = window.room.state, window.room, window.page.mouse

    def wrist() -> np.ndarray:
        assert state.actor is not None
        joint = state.actor.skeleton.names.index("left.wrist")
        return stage(state.actor, np.array([state.frame]), state.scene.rate).positions[0, joint]

    room.post(lambda: room.drag.take("wrist"))
    handle = room.server.scene._handle_from_node_name
    until(lambda: any(name == "/tip" for name in handle), "a handle is on the wrist")
    before, start = window.still(), wrist()
    (size,) = [one.scale for name, one in handle.items() if name == "/tip"]
    grip = start + np.array([0.0, 0.6 * size, 0.0])
    mouse.move(*window.at(grip))
    mouse.down()
    mouse.move(*window.at(grip + np.array([0.0, 0.03, 0.0])), steps=6)
    mouse.up()
    until(lambda: np.linalg.norm(wrist() - start) > 0.01, "the wrist is dragged away")
    assert room.worker.settle()
    moved = wrist() - start
    assert moved[1] > 0.9 * np.linalg.norm(moved)
    assert state.document.text.splitlines()[-1].startswith("MOVE LEFT 0 ")
    until(lambda: window.changed(before) > 300, "the hand is drawn where it was dragged")
    room.post(lambda: room.state.undo())
    assert room.worker.settle()
    until(lambda: np.linalg.norm(wrist() - start) < 1e-9, "it is undone in one step")


PLATE = """HAND LEFT BUILTIN RESOLUTION 1500
FRAMES 0 10
OBJECT PLATE BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165
MOVE LEFT 0 0 0.003 0
MOVE LEFT 10 0 -0.0055 0
FLESH LEFT INDEX ELEMENT 0.005
PRESS 0 10 EVERY 5
"""


@SLOW
def test_a_cancelled_solve_ends_and_the_next_is_seen_in_colours_though_the_page_is_reloaded(window: Window) -> None:
    room, state, page = window.room, window.room.state, window.page
    room.post(lambda: state.write(PLATE))
    assert room.worker.settle()
    window.tab("Work")
    window.press("PRESS: solve contact")
    window.press("Cancel")
    page.get_by_text("PRESS was cancelled").wait_for(timeout=120_000)
    assert state.pressed is None
    assert room.progress.work.running is None
    window.press("PRESS: solve contact")
    until(lambda: room.progress.work.running is not None, "it is being solved")
    window.reload()
    window.tab("Work")
    page.locator("#studio-verdict").wait_for(timeout=240_000)
    assert state.pressed is not None
    assert "kPa" in page.locator("#studio-verdict").inner_text()
    assert state.frame == 10
    window.tab("Pose")
    page.get_by_label("Objects", exact=True).uncheck()  # the plate lies before what it presses
    for client in room.server.get_clients().values():
        client.camera.position, client.camera.look_at = (0.06, -0.11, -0.22), (0.034, -0.018, -0.162)  # at the pad

    def red() -> bool:
        pixels = window.pixels()
        return int(((pixels[..., 0] > 100) & (pixels[..., 1] < 0.6 * pixels[..., 0])).sum()) > 20

    until(red, "pressure is seen on the pad")
    page.get_by_label("Contact points", exact=True).check()

    def green() -> bool:
        pixels = window.pixels()
        return int(((pixels[..., 1] > 120) & (pixels[..., 0] < 0.5 * pixels[..., 1])).sum()) > 20

    until(green, "contact points are seen on it")


@SLOW
def test_calibration_writes_parameters_and_changes_the_surface_seen(window: Window) -> None:
    state, path = window.room.state, window.room.state.document.path
    window.drag_slider("base flexion", 0.9)
    before = window.still()
    assert state.actor is not None
    old = state.shown()[0].vertices.copy()
    window.tab("Work")
    window.press("Calibrate the skin")
    until(lambda: "PARAMETERS" in state.document.text, "the skin is calibrated", timeout=600)
    assert window.room.worker.settle()
    assert state.error is None
    assert any("is fitted: loss" in line for line in state.messages)
    written = path.with_name(f"{path.stem}-{state.actor.name.lower()}.json")
    assert written.exists()
    assert state.document.text.splitlines()[-1] == f'PARAMETERS "{written.name}"'
    moved = np.linalg.norm(state.shown()[0].vertices - old, axis=1)
    assert moved.max() > 1e-4
    until(lambda: int((window.pixels() != before).any(axis=-1).sum()) > 50, "the changed skin is drawn")
    window.tab("Script")
    window.press("undo")
    until(lambda: "PARAMETERS" not in state.document.text, "it is undone")
