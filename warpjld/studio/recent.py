"""List of recently opened scripts, stored in the user's cache folder."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

from warpjld.files.kept_files import kept_folder
from warpjld.files.whole_file import whole_file

__all__ = ["note_recent", "recent_scripts"]

_FILE = "studio-recent.json"
_MOST = 8  # scripts that are listed


def recent_scripts() -> list[Path]:
    """Recent scripts that still exist, latest first; empty if the list cannot be read."""
    folder = kept_folder()
    if folder is None:
        return []
    try:
        names = json.loads((folder / _FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    known = [Path(name) for name in names if isinstance(name, str)] if isinstance(names, list) else []
    return [path for path in known if path.suffix.lower() == ".jld" and path.is_file()]


def note_recent(path: Path) -> None:
    """Put a script at the head of the list; failure to write the list is ignored."""
    folder = kept_folder()
    if folder is None:
        return
    names = [str(path.resolve()), *(str(other) for other in recent_scripts() if other != path.resolve())]
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        with whole_file(folder / _FILE) as part:
            part.write_text(json.dumps(names[:_MOST]), encoding="utf-8")
