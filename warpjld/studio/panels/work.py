"""Files and work: open, save, run the script, solve its contact; and what came of it."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.files.names import check_name
from warpjld.studio.background import JobProgress
from warpjld.studio.document import ScriptDocument
from warpjld.studio.making import made, pressed

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["WorkPanel"]


class WorkPanel:
    """Opening and saving inside the script's folder, ``RUN``, ``PRESS``, verdict and table."""

    def __init__(self, room: Room) -> None:
        self._room = room
        gui = room.server.gui
        self.name = gui.add_text("Script", room.state.document.path.name)
        self.files = gui.add_button_group("File", ("save", "open", "new"))
        self.scripts = gui.add_dropdown("In this folder", ("—",), initial_value="—")
        self.run = gui.add_button("RUN: make the files", hint="what warpjld run does with this script")
        self.press = gui.add_button("PRESS: solve contact", hint="and see the pressure on the skin")
        self.result = gui.add_html("")
        self.files.on_click(lambda event: self._file(event.target.value))
        self.scripts.on_update(lambda event: room.by_hand(event, self._choose))
        self.run.on_click(lambda _: room.post(self._run))
        self.press.on_click(lambda _: room.post(self._press))

    def refresh(self) -> None:
        """Show what is being done, and what came of contact."""
        running = self._room.progress.work.running is not None
        for control in (self.run, self.press):
            if control.disabled != running:
                control.disabled = running
        scripts = ("—", *sorted(path.name for path in self._folder.glob("*.jld")))
        if tuple(self.scripts.options) != scripts:
            self.scripts.options = scripts
        content = self._contact()
        if content != self.result.content:
            self.result.content = content

    @property
    def _folder(self) -> Path:
        return self._room.state.document.path.parent

    def _contact(self) -> str:
        solved = self._room.state.pressed
        if solved is None:
            return ""
        verdict = solved.simulation.verdict
        rows = "".join(
            f"<tr><td>{escape(row.digit)}</td><td>{row.force_n:.2f} N</td><td>{row.peak_kpa:.1f} kPa</td>"
            f"<td>{row.area_mm2:.0f} mm²</td><td>{escape(row.state)}</td></tr>"
            for row in solved.rows(self._room.state.frame)
        )
        lines = "".join(f"<li>{escape(line)}</li>" for line in (*verdict.lines, *verdict.suggestions))
        return (
            f'<div id="studio-verdict" style="padding:0 0.8em;font-size:0.8em"><b>{escape(verdict.text)}</b>'
            f"<table>{rows}</table><ul>{lines}</ul></div>"
        )

    def _choose(self) -> None:
        if self.scripts.value != "—":
            self.name.value = self.scripts.value

    def _file(self, what: str) -> None:
        state = self._room.state

        def act() -> None:
            path = self._path()
            match what:
                case "save":
                    state.messages.append(f"saved {state.document.save(path).name}")
                case "open":
                    state.open(ScriptDocument.open(path))
                case _:
                    if path.exists():
                        raise InputError(f"there is a file {path.name} already: give the new script another name")
                    state.open(ScriptDocument(path, "HAND LEFT BUILTIN\n"))

        self._room.post(act)

    def _path(self) -> Path:
        """The file in the script's folder that is named."""
        name = check_name(self.name.value.strip(), "the script's name")
        if Path(name).name != name:
            raise InputError(f"'{name}': want a plain name; scripts stay in the folder {self._folder}")
        return self._folder / (name if name.lower().endswith(".jld") else f"{name}.jld")

    def _run(self) -> None:
        state = self._room.state
        scene, script = state.copied_scene(), state.document.path

        def work(progress: JobProgress) -> object:
            return made(scene, script, progress)

        def told(result: Any) -> None:
            names = ", ".join(str(one["name"]) for one in result["files"])
            state.messages.append(f"made in {scene.folder}: {names}")

        self._room.progress.start("RUN", work, told)

    def _press(self) -> None:
        state = self._room.state
        scene, text = state.copied_scene(), state.document.text

        def told(result: Any) -> None:
            state.solved, state.coloring = result, "pressure"
            state.messages.append(result.simulation.verdict.text)

        self._room.progress.start("PRESS", lambda progress: pressed(text, scene, progress), told)
