"""``warpjld fem``: run a finite-element study from a TOML file."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from warpjld.cli import options
from warpjld.errors import WarpjldError

if TYPE_CHECKING:
    from rich.console import Console

    from warpjld.fem.study.study_results import Reaction

__all__ = ["fem_command"]

_ROUNDING = 1e-9  # reactions smaller than this fraction of the largest are shown as 0


@click.command("fem")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Output folder; the study's name by default.")
@click.option("--no-pictures", is_flag=True, help="Write no pictures.")
@options.json
@options.quiet
def fem_command(study: Path, out: Path | None, no_pictures: bool, as_json: bool, quiet: bool) -> None:
    """Solve the load steps of STUDY (a .toml file, see docs/reference/fem-study.md and examples/inflate_ball.toml).

    Output: NAME.pvd with one .vtu per instant (for ParaView), reactions.csv, and pictures of displacement and stress
    after each step; earlier files are replaced when all are made. If a step finds no equilibrium, or at Ctrl-C, the
    results so far are written and the exit code is 1, or 130.
    """
    from rich.console import Console

    from warpjld.cli.answer import answer
    from warpjld.fem import MaterialWarning
    from warpjld.fem.contact import ContactWarning
    from warpjld.fem.study.study_file import load_study
    from warpjld.fem.study.study_results import StudyResults
    from warpjld.runtime.quiet import silence_warp
    from warpjld.runtime.warning_texts import warning_texts
    from warpjld.script.folder import OutputFolder

    silence_warp()
    console = Console(quiet=quiet, highlight=False, markup=False, soft_wrap=True, stderr=as_json)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        loaded = load_study(study)
    notes = [*loaded.notes, *(str(warning.message) for warning in caught)]
    for note in notes:
        console.print(f"note: {note}")
    folder = out or Path(study.stem)
    mesh = loaded.body.mesh
    console.print(
        f"{loaded.title}: {len(mesh.elements)} elements, {loaded.body.degrees} degrees of freedom, "
        f"least scaled Jacobian {mesh.scaled_jacobian().min():.2f}"
    )
    started = time.perf_counter()
    stopped = False
    with OutputFolder(folder) as out_folder:
        results = StudyResults(loaded, out_folder.work, study.stem, pictures=not no_pictures)
        try:
            with warning_texts(ContactWarning, MaterialWarning) as warned:
                for reached in loaded.run(lambda text: console.print(f"  {text}")):
                    results.add(reached)
                    for text in warned():
                        notes.append(text)
                        console.print(f"note: {text}")
        except KeyboardInterrupt:
            if results.last is None:
                raise
            stopped = True
        results.finish()
        if results.last is None:
            raise WarpjldError("no equilibrium was reached")
    results.files = [folder / file.relative_to(out_folder.work) for file in results.files]
    seconds = time.perf_counter() - started
    if as_json:
        answer({"study": str(study), **results.content(), "seconds": round(seconds, 3), "notes": notes})
    else:
        _table(console, results.reactions)
        console.print(f"{seconds:.1f} s; results in {folder}")
    if stopped:
        instants = f"step {results.last.step.name}, load {results.last.instant.factor:.3f}"
        click.echo(f"stopped; the results so far ({instants}) are in {folder}", err=True)
        raise KeyboardInterrupt
    if not results.last.solution.converged:
        raise WarpjldError(f"{results.last.step.name}: {results.last.solution.message}")


def _table(console: Console, reactions: list[Reaction]) -> None:
    from rich.table import Table

    table = Table("step", "load", "where", "Rx, N", "Ry, N", "Rz, N", title="Reactions")
    largest = max((float(np.abs(row.force).max()) for row in reactions), default=0.0)
    for row in reactions:
        force = np.where(np.abs(row.force) > _ROUNDING * largest, row.force, 0.0)
        table.add_row(row.step, f"{row.load:.3f}", row.where, *(f"{f:.4g}" for f in force))
    console.print(table)
