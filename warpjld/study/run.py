"""Running or resuming a study, and writing its table, arrays, manifest and summary."""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import Any, Literal

from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.folders import make_folder
from warpjld.files.manifest import file_hash, fingerprint, versions, write_json
from warpjld.runtime.threads import cores
from warpjld.study.arrays import gathered, write_arrays
from warpjld.study.columns import COMMON_COLUMNS
from warpjld.study.experiment import Experiment
from warpjld.study.pool import run_trials
from warpjld.study.rates import Rate, success_rates
from warpjld.study.shards import Shards
from warpjld.study.summary import write_summary
from warpjld.tables.columns import Column
from warpjld.tables.files import require_parquet, write_parquet, write_table_csv

__all__ = ["StudyResult", "TableFormat", "opened", "run_study", "table_columns"]

TableFormat = Literal["parquet", "csv", "both"]
Report = Callable[[str, int, int], None]

_TRIALS, _IDENTITY = "trials", "study.json"


@dataclass(frozen=True, eq=False)
class StudyResult:
    """Result of ``run_study``.

    Attributes:
        files: Files written, without those of single trials.
        rates: Success rates; the first is that of all trials.
        ran: Number of trials run now; the others were on disk already.
        seconds: Wall-clock time [s].
        notes: Messages about the folder, such as damaged trials that were run again.
    """

    files: tuple[Path, ...]
    rates: tuple[Rate, ...]
    ran: int
    seconds: float
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        rates = f"{self.rates[0].successes} of {self.rates[0].trials} succeed" if self.rates else "no trials"
        return f"StudyResult({rates}, {self.ran} run now in {self.seconds:.1f} s)"


def table_columns(experiment: Experiment) -> tuple[Column, ...]:
    """Columns of the study's table, in order."""
    return (*COMMON_COLUMNS, *experiment.columns)


def run_study(
    experiment: Experiment,
    out: str | Path,
    *,
    processes: int | None = None,
    table: TableFormat = "parquet",
    fresh: bool = False,
    title: str = "study",
    ray: str | None = None,
    allow_mixed: bool = False,
    report: Report = lambda what, done, total: None,
) -> StudyResult:
    """Run the missing trials of a study, then write its table, arrays, manifest and summary.

    The table and ``poses.npz`` depend only on the experiment, byte for byte: not on the number of
    processes, nor on how often the study was stopped. Wall-clock times are in ``manifest.json``.

    Args:
        experiment: The experiment.
        out: Output folder; a study of the same experiment in it is resumed.
        processes: Number of worker processes; by default the number of cores.
        table: "parquet" (needs the extra ``study``), "csv", or "both".
        fresh: Delete the trials in ``out`` first.
        title: Title of the summary.
        ray: Address of a Ray cluster that runs the trials, or ``local``; None for processes of this machine.
        allow_mixed: Also use machines of the cluster whose results differ in bits.
        report: Called with a stage's name, steps done and steps in total.

    Raises:
        InputError: ``out`` holds another study, or cannot be written.
        MissingExtraError: The table is to be Parquet without pyarrow, or a cluster is given without Ray.
    """
    if table not in ("parquet", "csv", "both"):
        raise InputError(f"table: want 'parquet', 'csv' or 'both', got {table!r}")
    if processes is not None and processes < 1:
        raise InputError(f"processes: want 1 or more, got {processes}")
    if table != "csv":
        require_parquet()
    began, moment = time.perf_counter(), datetime.now(UTC)
    folder = Path(out)
    notes: list[str] = []
    shards = opened(experiment, folder, fresh=fresh, notes=notes)
    shards.sweep()
    missing = shards.missing(experiment.trials)
    damaged = [trial for trial in missing if shards.path(trial).exists()]
    if damaged:
        few = ", ".join(map(str, damaged[:5])) + (", …" if len(damaged) > 5 else "")
        notes.append(f"{len(damaged)} trials in {folder} are damaged and run again: {few}")
    finished = experiment.trials - len(missing)
    report("trials", finished, experiment.trials)

    def done(trial: int, status: str) -> None:
        nonlocal finished
        finished += 1
        report("trials", finished, experiment.trials)

    how: dict[str, Any] = {"ray": ray, "allow_mixed": allow_mixed, "processes": processes}
    where = _run_missing(experiment, missing, folder / _TRIALS, **how, done=done, note=notes.append)
    rows, arrays = gathered(shards.all(experiment.trials))
    files = _write_results(experiment, folder, rows, arrays, table)
    rates = success_rates(rows, experiment.success, experiment.groups)
    shown = [column for column in experiment.columns if column.name in experiment.shown]
    files += write_summary(folder, title, rates, rows, shown)
    total = time.perf_counter() - began
    run = {"started": moment.isoformat(timespec="seconds"), "seconds": round(total, 3), **where}
    content = {"title": title, **_described(experiment, rows, rates), **experiment.overall(rows, arrays)}
    content |= {
        "files": {file.name: file_hash(file) for file in files},
        "columns": [asdict(column) for column in table_columns(experiment)],
        "last_run": {**run, "trials_run": len(missing)},
        "trial_seconds": [round(shard.seconds, 4) for shard in shards.all(experiment.trials)],
    }
    write_json(folder / "manifest.json", content)
    return StudyResult((*files, folder / "manifest.json"), tuple(rates), len(missing), total, tuple(notes))


def _run_missing(
    experiment: Experiment,
    missing: list[int],
    kept: Path,
    *,
    ray: str | None,
    allow_mixed: bool,
    processes: int | None,
    done: Callable[[int, str], None],
    note: Callable[[str], None],
) -> dict[str, Any]:
    """Run trials in processes or on a cluster; a description of these, for the manifest."""
    # the summary is drawn afterwards, when the trials are waited for no more
    Thread(target=import_module, args=("matplotlib.backends.backend_agg",), daemon=True).start()
    if ray is None:
        workers = min(processes or cores(), max(len(missing), 1))
        run_trials(experiment, missing, kept, processes=workers, done=done)
        return {"processes": workers}
    if not missing:
        return {}
    from warpjld.study.cluster import run_on_ray

    how: dict[str, Any] = {"address": ray, "processes": processes, "allow_mixed": allow_mixed}
    return {"cluster": run_on_ray(experiment, missing, kept, **how, done=done, note=note)}


def _described(experiment: Experiment, rows: list[dict[str, Any]], rates: list[Rate]) -> dict[str, Any]:
    """The manifest's description of the experiment and of how its trials ended."""
    return {
        "trials": experiment.trials,
        "seed": experiment.seed,
        "seeds": "trial k draws from numpy.random.SeedSequence(seed, spawn_key=(k,))",
        "fingerprint": fingerprint(experiment.identity()),
        "experiment": experiment.identity(),
        "versions": versions(),
        "statuses": dict(Counter(str(row["status"]) for row in rows).most_common()),
        "rates": [asdict(rate) for rate in rates],
    }


def opened(experiment: Experiment, folder: Path, *, fresh: bool = False, notes: list[str] | None = None) -> Shards:
    """Open a study's folder; its trials, after a check that they belong to this experiment.

    If the file with their identity is damaged, the trials are renamed and kept, a note is added, and all are run again.

    Raises:
        InputError: They belong to another experiment, or the folder cannot be used.
    """
    identity = experiment.identity()
    known = folder / _IDENTITY
    make_folder(folder)
    try:
        if fresh and (folder / _TRIALS).exists():
            shutil.rmtree(folder / _TRIALS)
        if known.exists() and not fresh:
            before = _known(known)
            if before is None:
                aside = _set_aside(folder)
                if notes is not None:
                    notes.append(f"{known} is damaged: the old trials are in {aside}, and all trials are run again")
            else:
                _same_study(before, identity, folder)
        elif (folder / _TRIALS).exists():
            raise InputError("holds trials of an unknown study; choose another folder, or --fresh", path=folder)
        (folder / _TRIALS).mkdir(parents=True, exist_ok=True)
        write_json(known, identity)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be used as the study's folder: {error}", path=folder) from error
    return Shards(folder / _TRIALS, table_columns(experiment))


def _known(path: Path) -> dict[str, Any] | None:
    """Identity of the study in a folder; None if the file is damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def _set_aside(folder: Path) -> Path:
    number = next(k for k in range(1, 1000) if not (folder / f"{_TRIALS}.unknown{k}").exists())
    aside = folder / f"{_TRIALS}.unknown{number}"
    if (folder / _TRIALS).exists():
        (folder / _TRIALS).rename(aside)
    return aside


def _same_study(before: dict[str, Any], now: dict[str, Any], folder: Path) -> None:
    plain = json.loads(json.dumps(now, ensure_ascii=False))
    if fingerprint(before) == fingerprint(plain):
        return
    names = [name for name in {**before, **plain} if before.get(name) != plain.get(name)]
    raise InputError(
        f"holds a study with other settings ({', '.join(names)}); choose another folder, or --fresh to start again",
        path=folder,
    )


def _write_results(
    experiment: Experiment,
    folder: Path,
    rows: list[dict[str, Any]],
    arrays: dict[str, NDArray[Any]],
    table: TableFormat,
) -> list[Path]:
    columns, files = table_columns(experiment), []
    if table != "csv":
        write_parquet(folder / "table.parquet", rows, columns)
        files.append(folder / "table.parquet")
    if table != "parquet":
        write_table_csv(folder / "table.csv", rows, columns)
        files += [folder / "table.csv", folder / "columns.json"]
    write_arrays(folder / "poses.npz", arrays)
    return [*files, folder / "poses.npz"]
