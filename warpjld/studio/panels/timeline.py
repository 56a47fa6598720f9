"""Timeline: a slider over the frames, playback, stepping between keys."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from warpjld.studio.key_lines import number

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["TimelinePanel"]


class TimelinePanel:
    """The timeline."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._playing: threading.Event | None = None
        gui = room.server.gui
        self.frame = gui.add_slider("Frame", min=0, max=48, step=1, initial_value=0)
        self.play = gui.add_button_group("Play", ("play", "stop", "◂ key", "key ▸"))
        self.loop = gui.add_checkbox("Loop", True)
        self.keys = gui.add_button_group("Keys", ("set all", "delete"))
        self.frame.on_update(lambda event: room.by_hand(event, self._scrub, key="frame"))
        self.keys.on_click(lambda event: self._key(event.target.value))
        self.play.on_click(lambda event: self._press(event.target.value))

    def refresh(self) -> None:
        """Show the frame and the keys."""
        state = self._room.state
        first, last = state.span
        for name, value in (("min", first), ("max", last)):
            if getattr(self.frame, name) != value:
                setattr(self.frame, name, value)
        if not self._room.worker.waits("frame"):
            self.frame.value = min(max(round(state.frame), first), last)

    def _scrub(self) -> None:
        self._room.state.frame = float(self.frame.value)

    def _press(self, which: str) -> None:
        state = self._room.state
        match which:
            case "play":
                self._start()
            case "stop":
                self._stop()
            case "◂ key":
                self._room.post(lambda: self._go([k for k in state.keys if k < state.frame][-1:]))
            case _:
                self._room.post(lambda: self._go([k for k in state.keys if k > state.frame][:1]))

    def _key(self, which: str) -> None:
        state = self._room.state
        frame, actor = number(state.frame), state.actor
        if which == "set all":
            self._room.post(state.key_all)
        elif actor is not None:
            self._room.post(lambda: state.do(f"KEYS DELETE {frame} {actor.name}"))

    def _go(self, found: list[float]) -> None:
        if found:
            self._room.state.frame = found[0]

    def _start(self) -> None:
        self._stop()
        self._playing = stop = threading.Event()
        threading.Thread(target=self._run, args=(stop,), name="studio-play", daemon=True).start()

    def _stop(self) -> None:
        if self._playing is not None:
            self._playing.set()
            self._playing = None

    def _run(self, stop: threading.Event) -> None:
        while not stop.wait(1.0 / self._room.state.scene.rate):
            self._room.post(lambda: self._advance(stop), key="play")

    def _advance(self, stop: threading.Event) -> None:
        state = self._room.state
        first, last = state.span
        following = round(state.frame) + 1
        if following > last and not self.loop.value:
            stop.set()
        elif not stop.is_set():
            state.frame = float(first if following > last else following)
