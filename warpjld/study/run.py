"""Running a study from start, or from where it was stopped, to its table."""

from __future__ import annotations

import json
import shutil
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

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
    """What a finished study left.

    Attributes:
        files: Everything written but the single trials.
        rates: Success rates, the first of all trials.
        ran: Trials run now; the others were there already.
        seconds: Wall-clock time.
        notes: What was found in the folder, and done about it.
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
    report: Report = lambda what, done, total: None,
) -> StudyResult:
    """Run what is missing of a study, then write its table, arrays, manifest and summary.

    ``table.parquet``, ``table.csv`` and ``poses.npz`` depend on nothing but the experiment: not on the number of
    processes, nor on how often the study was stopped. Wall-clock times are in ``manifest.json``.

    Args:
        experiment: What to repeat.
        out: Folder; one that holds the same study is resumed.
        processes: Worker processes; as many as the machine has cores by default.
        table: "parquet" (wants the extra ``study``), "csv", or "both".
        fresh: Forget what ``out`` holds.
        title: For the summary.
        report: Called with what is being done, how much is done, and of how much.

    Raises:
        InputError: ``out`` holds another study, or cannot be written.
        MissingExtraError: Parquet is wanted and pyarrow is not installed.
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
        notes.append(f"{len(damaged)} trials kept in {folder} are damaged and run again: {few}")
    workers = min(processes or cores(), max(len(missing), 1))
    finished = experiment.trials - len(missing)
    report("trials", finished, experiment.trials)

    def done(trial: int, status: str) -> None:
        nonlocal finished
        finished += 1
        report("trials", finished, experiment.trials)

    run_trials(experiment, missing, folder / _TRIALS, processes=workers, done=done)
    files = _write_results(experiment, folder, shards, table)
    rows, seconds = _rows_and_seconds(shards, experiment.trials)
    rates = success_rates(rows, experiment.success, experiment.groups)
    shown = [column for column in experiment.columns if column.name in experiment.shown]
    files += write_summary(folder, title, rates, rows, shown)
    total = time.perf_counter() - began
    write_json(
        folder / "manifest.json",
        {
            "title": title,
            "trials": experiment.trials,
            "seed": experiment.seed,
            "seeds": "trial k draws from numpy.random.SeedSequence(seed, spawn_key=(k,))",
            "fingerprint": fingerprint(experiment.identity()),
            "experiment": experiment.identity(),
            "versions": versions(),
            "statuses": dict(Counter(str(row["status"]) for row in rows).most_common()),
            "rates": [asdict(rate) for rate in rates],
            "files": {file.name: file_hash(file) for file in files},
            "columns": [asdict(column) for column in table_columns(experiment)],
            "last_run": {
                "started": moment.isoformat(timespec="seconds"),
                "seconds": round(total, 3),
                "processes": workers,
                "trials_run": len(missing),
            },
            "trial_seconds": [round(value, 4) for value in seconds],
        },
    )
    return StudyResult((*files, folder / "manifest.json"), tuple(rates), len(missing), total, tuple(notes))


def opened(experiment: Experiment, folder: Path, *, fresh: bool = False, notes: list[str] | None = None) -> Shards:
    """The folder's trials, after making sure that they belong to this experiment.

    Where the file that says what they are is damaged, they are set aside, which is noted, and all are run again.

    Raises:
        InputError: They do not, or the folder cannot be used.
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
                    notes.append(f"{known} is damaged: what was there is in {aside}, and all trials are run again")
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
    """What a study's file says it is; None where it is damaged."""
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


def _write_results(experiment: Experiment, folder: Path, shards: Shards, table: TableFormat) -> list[Path]:
    rows, arrays = gathered(shards.all(experiment.trials))
    columns, files = table_columns(experiment), []
    if table != "csv":
        write_parquet(folder / "table.parquet", rows, columns)
        files.append(folder / "table.parquet")
    if table != "parquet":
        write_table_csv(folder / "table.csv", rows, columns)
        files += [folder / "table.csv", folder / "columns.json"]
    write_arrays(folder / "poses.npz", arrays)
    return [*files, folder / "poses.npz"]


def _rows_and_seconds(shards: Shards, trials: int) -> tuple[list[dict[str, Any]], list[float]]:
    found = [(shard.row, shard.seconds) for shard in shards.all(trials)]
    return [row for row, _ in found], [seconds for _, seconds in found]
