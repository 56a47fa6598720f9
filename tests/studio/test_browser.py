"""The studio in a real browser: what the mouse does is seen, and is in the script."""

from __future__ import annotations

from tests.studio.conftest import Window, until


def test_a_dragged_slider_bends_the_finger_on_screen_and_in_the_script(window: Window) -> None:
    before, state = window.pixels(), window.room.state
    window.drag_slider("base flexion", 0.9)
    until(lambda: window.changed(before) > 500, "the finger is drawn bent")
    until(lambda: state.angles()["left.index.base.flexion"] > 50, "the state has it bent")
    assert state.document.text.splitlines()[-1].startswith("JOINT left.index.base FLEXION AT 0 ")
    window.tab("Script")
    shown = window.page.locator("textarea").first
    until(lambda: shown.input_value() == state.document.text, "the pane shows the script")
    window.press("undo")
    until(lambda: state.angles()["left.index.base.flexion"] == 0, "it is undone")
    until(lambda: window.changed(before) < 50, "the finger is drawn as before")
