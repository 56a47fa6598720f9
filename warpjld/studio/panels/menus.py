"""Menus with an entry for every command (built-in and users') and every macro of the script; each opens a form."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from warpjld.script.menus import MENUS, place_in_menus
from warpjld.script.registry import Command, all_commands
from warpjld.studio.forms import ways_of_command, ways_of_macro
from warpjld.studio.panels.form import FormWindow

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["MenusPanel"]


class MenusPanel:
    """The menus, and the command palette (Ctrl+K) with the same entries."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._macros: tuple[str, ...] = ()
        self._folder: Any = None
        gui = room.server.gui
        gui.add_markdown("Every command has an entry here, and in the palette: **Ctrl+K**.")
        menus: dict[str, list[tuple[str, Command]]] = {name: [] for name in MENUS}
        for command in all_commands():
            name, entry = place_in_menus(command)
            menus.setdefault(name, []).append((entry, command))
        for name, entries in menus.items():
            if entries:
                with gui.add_folder(name, expand_by_default=False):
                    for entry, command in entries:
                        self._add(name, entry, command)

    def refresh(self) -> None:
        """Update the entries of the script's macros."""
        macros = self._room.state.performance.macros
        if tuple(macros) == self._macros:
            return
        self._macros = tuple(macros)
        if self._folder is not None:
            self._folder.remove()
            self._folder = None
        if macros:
            self._folder = self._room.server.gui.add_folder("Macros", expand_by_default=False)
            with self._folder:
                for name in macros:
                    self._button(name, "a macro of this script", self._of_macro(name))

    def _add(self, menu: str, entry: str, command: Command) -> None:
        def open_form(event: Any) -> None:
            FormWindow(self._room, event.client, command.name, command.help, ways_of_command(command))

        self._button(entry, command.help, open_form)
        found = self._room.server.gui.add_command(f"{menu}: {entry}", description=command.help)
        found.on_trigger(open_form)

    def _of_macro(self, name: str) -> Callable[[Any], None]:
        def open_form(event: Any) -> None:
            macro = self._room.state.performance.macros.get(name)
            if macro is not None:
                FormWindow(self._room, event.client, name, "a macro of this script", ways_of_macro(macro))

        return open_form

    def _button(self, label: str, hint: str, press: Callable[[Any], None]) -> None:
        self._room.server.gui.add_button(label, hint=hint).on_click(press)
