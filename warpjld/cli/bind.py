"""``warpjld bind``: bind a rig and save the binding to a file."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Literal

import click

from warpjld.cli import options
from warpjld.cli.answer import answer

__all__ = ["bind_command"]


@click.command("bind")
@click.argument("rig")
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path, dir_okay=False), help=".npz to write.")
@options.rig
@options.parameters
@options.domains
@options.json
@options.quiet
def bind_command(
    rig: str,
    out: Path,
    parameters: Path | None,
    domains: Literal["geometry", "skin"],
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Bind RIG and save the binding to a file, for deform --binding with the same options.

    Without such a file, bindings are kept in the user's cache folder; WARPJLD_CACHE names another one, or is off."""
    from warpjld.cli.rig_argument import open_rig, rig_files
    from warpjld.covering import bind_rig, load_parameters
    from warpjld.covering.kept import save_binding
    from warpjld.errors import InputError
    from warpjld.files.overwriting import check_outputs
    from warpjld.runtime.quiet import silence_warp

    began = time.perf_counter()
    silence_warp()
    if out.suffix != ".npz":
        raise InputError("want a name that ends in .npz", path=out)
    if not out.absolute().parent.is_dir():
        raise InputError("cannot write the binding: no such folder", path=out.parent)
    check_outputs([out], rig_files(rig, how | {"parameters": parameters}))
    opened = open_rig(rig, **how)
    chosen = None if parameters is None else load_parameters(parameters, opened.skeleton)
    covering = bind_rig(opened, parameters=chosen, domains=domains)
    try:
        save_binding(out, covering, opened, parameters=chosen, domains=domains)
    except OSError as error:
        raise InputError(f"cannot write the binding: {error.strerror}", path=out) from None
    seconds = round(time.perf_counter() - began, 3)
    summary = {"rig": rig, "binding": str(out), "vertices": len(opened.surface.vertices), "seconds": seconds}
    if as_json:
        answer(summary)
    elif not quiet:
        click.echo(f"{out}: {summary['vertices']} vertices bound; {seconds} s")
