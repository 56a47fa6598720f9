"""Form window of a command: fields for its arguments, the resulting line, and a button that runs it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from warpjld.studio.forms import first_value, known_names
from warpjld.studio.syntax import Choice, Field, Option, TextField, Way, line_of

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["FormWindow"]

_NONE = "—"
_SHOWN = 34  # characters of a way's title that the list shows; longer ones are written out below it


class FormWindow:
    """Form of a command or macro in one browser window.

    Args:
        room: The studio.
        client: The browser window.
        name: The command or macro.
        about: Its help text.
        ways: The ways to call it.
    """

    def __init__(self, room: Room, client: Any, name: str, about: str, ways: Sequence[Way]) -> None:
        self._room, self._gui, self._name = room, client.gui, name
        named = [way.title for way in ways]
        self._ways = {
            title if named.count(title) == 1 else f"{title} ({k})": way
            for k, (title, way) in enumerate(zip(named, ways, strict=True), start=1)
        }
        self._controls: dict[tuple[int, ...], Any] = {}
        self._made: list[Any] = []
        self._modal = client.gui.add_modal(name)
        with self._modal:
            self._gui.add_markdown(about)
            self._line = self._gui.add_text("line", "", multiline=True, hint="what is done; it can be edited")
            titles = tuple(self._ways)
            self._way = self._gui.add_dropdown("way", titles, initial_value=titles[0]) if len(titles) > 1 else None
            self._title = self._gui.add_markdown("", visible=False)
            self._folder = self._gui.add_folder("values")
            self._said = self._gui.add_markdown("")
            do, cancel = self._gui.add_button("Do it"), self._gui.add_button("Cancel")
        if self._way is not None:
            self._way.on_update(lambda _: self._make())
        do.on_click(lambda _: self._do())
        cancel.on_click(lambda _: self._modal.close())
        self._make()

    def _chosen(self) -> Way:
        return next(iter(self._ways.values())) if self._way is None else self._ways[self._way.value]

    def _make(self) -> None:
        for control in self._made:
            control.remove()
        self._made, self._controls = [], {}
        if self._way is not None:
            title: str = self._way.value
            self._title.visible = len(title) > _SHOWN
            self._title.content = f"`{self._name} {title}`"
        with self._folder:
            self._add(self._chosen().fields, ())
        self._show()

    def _add(self, fields: tuple[Field, ...], place: tuple[int, ...]) -> None:
        for k, field in enumerate(fields):
            here = (*place, k)
            match field:
                case Choice(label, options, optional, _):
                    choices = (_NONE, *options) if optional else options
                    self._keep(here, self._gui.add_dropdown(label, choices, initial_value=choices[0]))
                case Option(keyword, inner):
                    label = keyword.lower() or " ".join(f.label for f in inner if isinstance(f, TextField | Choice))
                    self._keep(here, self._gui.add_checkbox(label or "more", False))
                    self._add(inner, here)
                case TextField():
                    self._keep(here, self._value(field))

    def _value(self, field: TextField) -> Any:
        # without their dots, which are places where a label's line may break
        endings = ", ".join(suffix.removeprefix(".") for suffix in field.suffixes)
        label = f"{field.label} ({endings})" if endings else field.label
        names = known_names(field, self._room.state.scene)
        if names:
            return self._gui.add_dropdown(label, tuple(names), initial_value=names[0])
        if field.number and not field.repeated:
            return self._gui.add_number(label, first_value(field, self._room.state.frame), step=0.001)
        return self._gui.add_text(label, f"{field.label}{field.suffixes[0]}" if field.suffixes else "")

    def _keep(self, place: tuple[int, ...], control: Any) -> None:
        self._controls[place] = control
        self._made.append(control)
        control.on_update(lambda _: self._show())

    def _written(self) -> str:
        values = {place: control.value for place, control in self._controls.items()}
        plain = {place: "" if value == _NONE else value for place, value in values.items()}
        return line_of(self._name, self._chosen(), plain)

    def _show(self) -> None:
        self._line.value = self._written()

    def _do(self) -> None:
        line = " ".join(self._line.value.splitlines())  # its field has several rows, but a command is one line

        def job() -> None:
            if self._room.state.do(line):
                self._modal.close()
            else:
                self._said.content = f"**{self._room.state.error}**"

        self._room.post(job)
