"""``warpjld fem``: a finite-element study from a TOML file."""

from __future__ import annotations

import csv
import io
import time
import warnings
from pathlib import Path
from typing import Any

import click

from warpjld.cli import options
from warpjld.errors import InputError, WarpjldError

__all__ = ["command"]


@click.command("fem")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Output folder; the study's name by default.")
@click.option("--no-pictures", is_flag=True, help="Write no pictures.")
@options.quiet
def command(study: Path, out: Path | None, no_pictures: bool, quiet: bool) -> None:
    """Solve the load steps of STUDY (a .toml file, see examples/fem.md and examples/inflate_ball.toml).

    Written: NAME.pvd with one .vtu an instant (for ParaView), reactions.csv, and pictures of displacement and stress
    after each step. When a step finds no equilibrium, what was reached is written and the exit code is 1.
    """
    from rich.console import Console
    from rich.table import Table

    from warpjld.cli.progress import silence_warp
    from warpjld.fem.study_file import load_study
    from warpjld.fem.vtk import Series

    silence_warp()
    console = Console(quiet=quiet, highlight=False)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loaded = load_study(study)
    for note in (*loaded.notes, *(str(warning.message) for warning in caught)):
        console.print(f"note: {note}", markup=False)
    folder = out or Path(study.stem)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write into this folder: {error.strerror}", path=folder) from error
    mesh = loaded.body.mesh
    console.print(
        f"{loaded.title}: {len(mesh.elements)} elements, {loaded.body.degrees} degrees of freedom, "
        f"least scaled Jacobian {mesh.scaled_jacobian().min():.2f}",
        markup=False,
    )
    started = time.perf_counter()
    series = Series(folder / f"{study.stem}.pvd")
    rows: list[list[Any]] = []
    last = None
    for reached in loaded.run(lambda text: console.print(f"  {text}", markup=False)):
        series.add(reached.time, loaded.body, reached.instant)
        for where, degrees in reached.held.items():
            force = [reached.instant.reactions.reshape(-1)[degrees[degrees % 3 == axis]].sum() for axis in range(3)]
            rows.append([reached.step.name, reached.instant.factor, where, *force])
        _write_reactions(folder / "reactions.csv", rows)
        if last is not None and last.step is not reached.step and not no_pictures:
            _pictures(folder, loaded, last)
        last = reached
    if last is None:
        raise WarpjldError("no equilibrium was reached")
    if not no_pictures:
        _pictures(folder, loaded, last)
    table = Table("step", "load", "where", "Rx, N", "Ry, N", "Rz, N", title="Reactions")
    for step, factor, where, *force in rows:
        table.add_row(step, f"{factor:.3f}", where, *(f"{f:.4g}" for f in force))
    console.print(table)
    console.print(f"{time.perf_counter() - started:.1f} s; results in {folder}", markup=False)
    if not last.solution.converged:
        raise WarpjldError(f"{last.step.name}: {last.solution.message}")


def _pictures(folder: Path, study: Any, reached: Any) -> None:
    from warpjld.fem.pictures import QUANTITIES, draw

    for quantity in QUANTITIES:
        name = f"{reached.step.name.replace(' ', '-')}_{quantity}.png"
        title = f"{study.title}: {reached.step.name}"
        draw(folder / name, study.body, reached.instant, quantity, title)


def _write_reactions(path: Path, rows: list[list[Any]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(["step", "load", "where", "rx_newton", "ry_newton", "rz_newton"])
    writer.writerows(rows)
    part = path.with_name(path.name + ".part")
    part.write_text(text.getvalue())
    part.replace(path)
