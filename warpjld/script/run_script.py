"""Running a script file and making its outputs: the function behind ``warpjld run``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from warpjld.script.interpreter import Interpreter
from warpjld.script.plugin import load_commands
from warpjld.script.runner import Report, run_scene
from warpjld.script.scene import Scene

__all__ = ["run_script"]


def run_script(
    script: str | Path,
    out: str | Path = "out",
    *,
    commands: Sequence[str | Path] = (),
    check: bool = False,
    page: bool = False,
    device: str = "cpu",
    threads: int | None = None,
    say: Callable[[str], None] = print,
    progress: Report = lambda what, done, total: None,
) -> dict[str, Any]:
    """Run a script and write the pictures, films, exports and tables that it specifies.

    If it specifies none, an animated surface (NPZ), a film and a contact sheet are written.

    Args:
        script: Script file (A §9).
        out: Output folder; made if missing. Files appear in it when all that can be made are complete.
        commands: Python files that add commands (see ``command``).
        check: Only check the script and list its outputs; compute and write nothing.
        page: Also write the animation as an interactive HTML page for any browser.
        device: Warp device.
        threads: CPU threads; None: chosen automatically.
        say: Function that receives the lines of PRINT and SHOW.
        progress: Called with a stage's name, steps done and steps in total.

    Returns:
        The summary, as JSON values; it is also written as ``summary.json``.

    Raises:
        InputError: A command that is not understood or cannot be carried out; names file, line and column.
        WarpjldError: Some output could not be made; all others are in the folder.
        MissingExtraError: A format needs an optional dependency.

    Examples:
        >>> from tempfile import mkdtemp
        >>> folder = Path(mkdtemp())
        >>> _ = (folder / "bend.jld").write_text('''
        ... HAND LEFT BUILTIN RESOLUTION 1500
        ... FINGER1 LEFT INDEX FLEXION AT 0 0
        ... FINGER1 LEFT INDEX FLEXION AT 10 60
        ... EXPORT "bend.npz"
        ... ''')
        >>> summary = wj.run_script(folder / "bend.jld", folder)
        >>> [file["name"] for file in summary["files"]]
        ['bend.npz']
    """
    for path in commands:
        load_commands(Path(path))
    folder, file = Path(out), Path(script)
    scene = Scene(folder=folder, say=say, dry=check, device=device)
    Interpreter(scene).run_file(file)
    return run_scene(
        scene, folder, script=file, device=device, threads=threads, dry=check, page=page, progress=progress
    )
