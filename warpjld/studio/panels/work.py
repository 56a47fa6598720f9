"""Panel of jobs: run the script, solve its contact, calibrate its skin; and of their results."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.studio.background import JobProgress
from warpjld.studio.fitting import fit_skin
from warpjld.studio.making import Pressed, made, open_joints, pressed

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["WorkPanel"]


class WorkPanel:
    """``RUN``, ``PRESS``, calibration, verdict and table."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._seen: float | None = None
        gui = room.server.gui
        self.run = gui.add_button("RUN: make the files", hint="what warpjld run does with this script")
        self.press = gui.add_button("PRESS: solve contact", hint="and see the pressure on the skin, frame by frame")
        self.fit = gui.add_button("Calibrate the skin", hint="what warpjld calibrate does with this actor")
        self.result = gui.add_html("")
        self.open = gui.add_button("Open joints as suggested", visible=False)
        self.run.on_click(lambda _: room.post(self._run))
        self.press.on_click(lambda _: room.post(self._press))
        self.fit.on_click(lambda _: room.post(self._fit))
        self.open.on_click(lambda _: room.post(self._open))

    def refresh(self) -> None:
        """Update the results of the contact solve."""
        running = self._room.progress.work.running is not None
        for control in (self.run, self.press, self.fit):
            if control.disabled != running:
                control.disabled = running
        content = self._contact()
        if content != self.result.content:
            self.result.content = content
        suggested = bool(self._openings())
        if self.open.visible != suggested:
            self.open.visible = suggested

    def _contact(self) -> str:
        solved = self._room.state.pressed
        if solved is None or solved.simulation is None:
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

    def _openings(self) -> Any:
        solved = self._room.state.pressed
        return () if solved is None or solved.simulation is None else solved.simulation.verdict.openings

    def _open(self) -> None:
        open_joints(self._room.state, self._openings())

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
        self._seen = None

        def show(so_far: Pressed) -> None:
            state.solved, state.coloring = so_far, "pressure"
            last = so_far.surfaces.frames[-1].frame
            if self._seen in (None, state.frame):  # unless the user has moved to another frame
                state.frame = self._seen = last

        def told(result: Pressed) -> None:
            assert result.simulation is not None
            state.solved, state.coloring = result, "pressure"
            state.messages.append(result.simulation.verdict.text)

        def work(progress: JobProgress) -> Pressed:
            return pressed(
                text, scene, progress, lambda so_far: self._room.post(lambda: show(so_far), key="solved frame")
            )

        self._room.progress.start("PRESS", work, told)

    def _fit(self) -> None:
        state = self._room.state
        scene, actor = state.copied_scene(), state.actor
        if actor is None:
            raise InputError("there is no actor whose skin could be calibrated")
        name, path = actor.name, state.document.path.with_name(f"{state.document.path.stem}-{actor.name.lower()}.json")

        def told(losses: tuple[float, float]) -> None:
            state.messages.append(f"the skin of {name} is fitted: loss {losses[0]:.3g} before, {losses[1]:.3g} after")
            speak = "" if state.scene.current == name else f"ACTOR {name}\n"
            state.do(f'{speak}PARAMETERS "{path.name}"')

        self._room.progress.start("calibration", lambda progress: fit_skin(scene, name, path, progress), told)
