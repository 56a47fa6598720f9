"""``warpjld place``: propose named points for a digitised surface, to be corrected by hand (R12)."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from warpjld.cli import options
from warpjld.cli.answer import answer

__all__ = ["place_command"]


@click.command("place")
@click.argument("surface", type=click.Path(path_type=Path))
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path), help="Points file to write (JSON).")
@click.option("--side", type=click.Choice(["left", "right"]), help="SURFACE is this hand.")
@click.option("--picture", type=click.Path(path_type=Path), help="Picture (PNG) of the points in the surface.")
@options.json
@options.quiet
def place_command(surface: Path, out: Path, side: str | None, picture: Path | None, as_json: bool, quiet: bool) -> None:
    """Propose the 87 named points of a digitised body, or the 25 of a hand, from SURFACE alone.

    A body must stand upright along an axis, with legs, arms and fingers apart. The file is in SURFACE's own unit and
    axes. Look at it with `inspect SURFACE --points FILE`, correct it by hand, use it in scripts with MODEL … POINTS.
    """
    from warpjld.files.overwriting import check_outputs
    from warpjld.io.mesh_file import read_mesh
    from warpjld.io.points_file import write_points_file
    from warpjld.runtime.quiet import silence_warp
    from warpjld.skeleton.place.place import propose_points

    silence_warp()
    check_outputs([path for path in (out, picture) if path is not None], [surface])
    mesh = read_mesh(surface)
    points = propose_points(mesh.vertices, mesh.faces, side=side, label=str(surface))
    write_points_file(out, points)
    if picture is not None:
        from warpjld.cli.inspect_picture import draw_rig
        from warpjld.io import load_rig

        draw_rig(load_rig(surface, points=out), picture)
    report = {
        "file": str(surface),
        "kind": "body" if "pelvis" in points else "hand",
        "points": {name: [float(f"{x:.7g}") for x in np.asarray(place)] for name, place in points.items()},
        "written": str(out),
        "picture": None if picture is None else str(picture),
    }
    if as_json:
        answer(report)
    elif not quiet:
        click.echo(f"{len(points)} points of a {report['kind']}: {out}")
        if picture is not None:
            click.echo(f"picture: {picture}")
