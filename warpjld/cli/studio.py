"""``warpjld studio``: edit a script in the browser with a 3D view (R88)."""

from __future__ import annotations

import time
from pathlib import Path

import click

from warpjld.cli import options

__all__ = ["studio_command"]


@click.command("studio")
@click.argument("script", required=False, type=click.Path(path_type=Path))
@options.out_folder
@options.device
@options.commands
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on; any other needs a token.")
@click.option("--port", default=8080, show_default=True, type=click.IntRange(0, 65535), help="Port, or the next free.")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.")
def studio_command(
    script: Path | None, out: Path, device: str, commands: tuple[Path, ...], host: str, port: int, browser: bool
) -> None:
    """Open SCRIPT, or a rig, in the studio in the browser: pose, set keys, grasp, press. Files are read from the
    script's folder only. Ctrl-C ends it; unsaved edits are kept in a file next to the script and restored next time."""
    from warpjld.runtime.quiet import silence_warp
    from warpjld.script.plugin import load_commands
    from warpjld.studio.opening import opened_document
    from warpjld.studio.room import Room

    silence_warp()
    for path in commands:
        load_commands(path)
    room = Room(opened_document(script, out, device=device), host=host, port=port)
    click.echo(f"studio: {room.address}")
    click.echo("Ctrl-C ends it")
    if browser:
        click.launch(room.address)
    try:
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        click.echo("ended")
    finally:
        room.stop()
