"""Grasps panel: closing and opening of the hand, and choice among grasps found by a search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from warpjld.studio.background import JobProgress
from warpjld.studio.grasp_ways import GraspWay, find_ways
from warpjld.studio.key_lines import number

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["GraspsPanel"]

_NOTHING = "—"


class GraspsPanel:
    """Buttons that close and open the hand, and a list of the grasps that AUTO found, with preview."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._ways: dict[str, GraspWay] = {}
        self._text = ""
        gui = room.server.gui
        self.length = gui.add_number("Frames to close in", 20, min=1, step=1)
        self.grasp = gui.add_button_group("Grasp", ("close", "auto", "release"))
        self.ways = gui.add_dropdown("Way to take it", (_NOTHING,), initial_value=_NOTHING, visible=False)
        self.take = gui.add_button("Take it this way", visible=False)
        self.grasp.on_click(lambda event: room.post(lambda: self._grasp(event.target.value)))
        self.ways.on_update(lambda event: room.by_hand(event, self._look))
        self.take.on_click(lambda _: room.post(self._take))

    def refresh(self) -> None:
        """Show the found grasps as long as the script is the one they were searched for."""
        if self._ways and self._text != self._room.state.document.text:
            self._ways = {}
        names = (_NOTHING, *self._ways)
        if tuple(self.ways.options) != names:
            self.ways.options = names
        for control in (self.ways, self.take):
            if control.visible != bool(self._ways):
                control.visible = bool(self._ways)

    def _command(self) -> tuple[str, str, str]:
        """First frame, last frame and side, as words of a command."""
        state = self._room.state
        sides = {name.partition(".")[0] for name in state.channels()} & {"left", "right"}
        side = sorted(sides)[0].upper() if sides else ""
        return number(state.frame), number(state.frame + self.length.value), side

    def _grasp(self, action: str) -> None:
        """Append the command for ``close`` or ``release``, or search for ``auto``."""
        first, last, side = self._command()
        state, thing = self._room.state, self._room.things.which.value
        if action == "release":
            state.do(f"RELEASE {first} {last} {side}".rstrip())
            return
        line = " ".join(word for word in ("GRASP", first, last, side, thing) if word)
        if action == "close":
            state.do(line)
            return
        self._search(f"{line} AUTO")

    def _search(self, line: str) -> None:
        state = self._room.state
        text, path, last = state.document.text, state.document.path, state.frame + self.length.value
        state.copied_scene()  # raises the error of a script that cannot be run
        performance = state.performance.beside()

        def work(progress: JobProgress) -> list[GraspWay]:
            return find_ways(performance, path, text, line, progress, lambda way: self._room.post(lambda: add([way])))

        def add(ways: list[GraspWay]) -> None:
            if state.document.text == text:
                known = {} if self._text != text else self._ways
                every = {way.title: way for way in ways} | known
                self._ways = dict(sorted(every.items(), key=lambda item: -float(item[1].outcome.values["score"])))
                self._text = text
                self._show(next(iter(self._ways)), last)

        def done(ways: list[GraspWay]) -> None:
            state.messages.append(f"{len(ways)} grasps found: choose one under Objects")

        self._ways = {}
        self._room.progress.start("GRASP AUTO", work, done)

    def _show(self, title: str, frame: float) -> None:
        way = self._ways[title]
        self.ways.options = (_NOTHING, *self._ways)
        self.ways.value = title
        self._room.state.preview = self._text, way.scene
        self._room.state.frame = frame

    def _look(self) -> None:
        title: Any = self.ways.value
        if title in self._ways:
            self._show(title, self._ways[title].outcome.frame)
        else:
            self._room.state.preview = None

    def _take(self) -> None:
        way = self._ways.get(self.ways.value)
        if way is not None:
            state = self._room.state
            state.preview = None
            state.performance.learn(way.performance)
            state.put(way.text)
