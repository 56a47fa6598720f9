"""A progress bar on stderr, for people only: nothing is written where stderr is not a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["Report", "progress", "silence_warp"]

Report = Callable[[str, int, int], None]
"""What long work calls: what is being done, how much of it is done, and how much there is."""


@contextmanager
def progress(quiet: bool = False) -> Iterator[Report]:
    """A bar, gone when the work is done."""
    if quiet or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("")
        yield lambda what, done, total: bar.update(task, description=what, completed=done, total=total)


def silence_warp() -> None:
    """Start Warp without its greeting on stdout, which belongs to what the command prints, and without its native
    library's remark on stderr that there is no GPU: whoever asks for one is told by an error."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    sys.stderr.flush()
    kept = os.dup(2)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        warp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
