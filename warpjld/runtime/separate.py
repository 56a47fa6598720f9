"""Calls of functions in a process of their own, with limits on memory and time.

Libraries written in C++ may crash on a damaged file, or allocate what it announces. A process that crashes, needs too
much memory or does not end in time is an error of the file, in one line. One process is kept for the calls that follow,
since starting it takes longer than reading a usual file; it ends when it is idle, or with this process.

Requests and answers are lines of JSON over pipes; arrays are left in a folder. Nothing is unpickled.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.limits import limit, variable
from warpjld.runtime.separate_process import LATE, end_process, running_process

__all__ = ["Answer", "separately"]

_TRIES = 2  # a process may end, being idle, just when it is asked
_MOST_SHARES = 4  # times the limit that a large file's bytes may add to it
_lock = threading.RLock()


@dataclass(frozen=True)
class Answer:
    """What a call gave.

    Attributes:
        value: The function's result.
        folder: Where it left files; they last as long as the context of ``separately``.
    """

    value: Any
    folder: Path


@contextmanager
def separately(
    place: tuple[str, str],
    path: Path,
    kind: str,
    *arguments: object,
    per_byte: int,
    within: str = "reader-seconds",
    seconds_per_byte: float = 0.0,
    once: bool = False,
) -> Iterator[Answer]:
    """Result of ``function(folder, path, *arguments)``, called in a process of its own.

    Args:
        place: The function's module and name. It writes arrays to files in the folder, and returns the rest of its
            result as JSON has it.
        path: The file that it reads.
        kind: Expected kind of file, for messages.
        arguments: Further arguments, as JSON has them.
        per_byte: Memory that it may use for each byte of the file, besides the limit ``reader-bytes`` and up to
            four times as much as that.
        within: Name of the limit on the time that it may take.
        seconds_per_byte: Time that it may take for each byte of the file, besides that limit [s].
        once: Whether the process ends after the call, since the library leaves memory that is never freed.

    Raises:
        InputError: As the function does; or the process crashed, needed too much memory, or did not end in time.
    """
    memory = limit("reader-bytes")
    memory += min(per_byte * _size(path), _MOST_SHARES * memory)
    seconds = limit(within) + seconds_per_byte * _size(path)
    request = {
        "place": place,
        "path": str(path.absolute()),
        "kind": kind,
        "arguments": arguments,
        "memory": memory,
        "limits": {name: value for name, value in os.environ.items() if name.startswith(variable(""))},
    }
    with _lock:
        try:
            yield _answer(json.dumps(request), path, kind, memory, (within, seconds))
        finally:
            if once:
                end_process()


def _answer(request: str, path: Path, kind: str, memory: int, time: tuple[str, float]) -> Answer:
    (within, seconds), code = time, 0
    for _ in range(_TRIES):
        try:
            process = running_process()
        except OSError as error:
            why = f"the process that reads it does not start ({error.strerror or error})"
            raise InputError(f"cannot be read as {kind}: {why}", path=path) from error
        line = process.asked(request, seconds)
        if line.endswith("\n"):
            told = json.loads(line)
            if "memory" in told:
                raise _too_much(kind, memory, path)
            if "refused" in told:
                raise _refusal(told["refused"], path)
            return Answer(told["value"], process.folder)
        code = process.end()
        if line == LATE:
            raise InputError(
                f"cannot be read as {kind}: not done after {seconds:.0f} s (raise it by warpjld --limit {within}=… or "
                f"{variable(within)})",
                path=path,
            )
        if code:
            break
    raise _too_much(kind, memory, path, f"the process that reads it ends with code {code}: the file is damaged, or ")


def _too_much(kind: str, memory: int, path: Path, why: str = "") -> InputError:
    """Error of a file whose reading needs more memory than it may [bytes]."""
    return InputError(
        f"cannot be read as {kind}: {why}it needs more than {memory:,} bytes of memory (raise it by warpjld --limit "
        f"reader-bytes=… or {variable('reader-bytes')})",
        path=path,
    )


def _refusal(told: dict[str, Any], path: Path) -> InputError:
    own = told["path"] in (None, str(path.absolute()))
    return InputError(told["message"], path=path if own else told["path"], line=told["line"], column=told["column"])


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):  # the function says what is wrong with it
        return 0
