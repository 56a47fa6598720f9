"""Files panel: scripts in the current folder and recently opened ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import InputError
from warpjld.files.names import check_name
from warpjld.studio.document import ScriptDocument
from warpjld.studio.opening import readable
from warpjld.studio.recent import note_recent, recent_scripts

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["FilesPanel"]

_NOTHING = "—"


class FilesPanel:
    """Controls to open and save scripts; except for recent ones, scripts must be in the current script's folder."""

    def __init__(self, room: Room) -> None:
        self._room = room
        gui = room.server.gui
        self.name = gui.add_text("Script", room.state.document.path.name)
        self.files = gui.add_button_group("File", ("save", "open", "new"))
        self.scripts = gui.add_dropdown("In this folder", (_NOTHING,), initial_value=_NOTHING)
        self.recent = gui.add_dropdown("Recent", (_NOTHING,), initial_value=_NOTHING)
        self._recent: dict[str, Path] = {}
        self._noted: Path | None = None
        self.files.on_click(lambda event: self._file(event.target.value))
        self.scripts.on_update(lambda event: room.by_hand(event, self._choose))
        self.recent.on_update(lambda event: room.by_hand(event, self._reopen))

    def refresh(self) -> None:
        """Update the lists of scripts."""
        path = self._room.state.document.path
        scripts = (_NOTHING, *sorted(script.name for script in path.parent.glob("*.jld")))
        if tuple(self.scripts.options) != scripts:
            self.scripts.options = scripts
        if path != self._noted:
            self._noted = path
            if path.is_file():
                note_recent(path)
            self._list_recent()

    def _list_recent(self) -> None:
        here = self._room.state.document.path
        self._recent = {f"{path.name} ({path.parent.name})": path for path in recent_scripts() if path != here}
        self.recent.options = (_NOTHING, *self._recent)

    def _choose(self) -> None:
        if self.scripts.value != _NOTHING:
            self.name.value = self.scripts.value

    def _reopen(self) -> None:
        path = self._recent.get(self.recent.value)
        if path is not None:
            self._open(path)

    def _open(self, path: Path) -> None:
        document = ScriptDocument.open(path)
        inside = path.parent == self._room.state.document.path.parent
        self._room.state.open(document, within=None if inside else readable(document))
        self.name.value = path.name

    def _file(self, action: str) -> None:
        """Perform ``save``, ``open`` or ``new`` on the named file."""
        state = self._room.state

        def act() -> None:
            path = self._path()
            match action:
                case "save":
                    state.messages.append(f"saved {state.document.save(path).name}")
                    note_recent(path)
                case "open":
                    self._open(path)
                case _:
                    if path.exists():
                        raise InputError(f"there is a file {path.name} already: give the new script another name")
                    state.open(ScriptDocument(path, "HAND LEFT BUILTIN\n"))

        self._room.post(act)

    def _path(self) -> Path:
        """Path of the named file in the script's folder."""
        folder = self._room.state.document.path.parent
        name = check_name(self.name.value.strip(), "the script's name")
        if Path(name).name != name:
            raise InputError(f"'{name}': want a plain name; scripts stay in the folder {folder}")
        return folder / (name if name.lower().endswith(".jld") else f"{name}.jld")
