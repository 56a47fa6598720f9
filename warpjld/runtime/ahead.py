"""A generator that runs in a process of its own while this one does something else, and whose items are taken later.

Importing Warp and SciPy takes as long as reading a rig and a motion, and one interpreter does one thing at a time. The
process is one of this program's own, so what it sends is unpickled.
"""

from __future__ import annotations

import io
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from warpjld.errors import WarpjldError
from warpjld.runtime.lazily import imported

__all__ = ["Ahead", "LostError", "serve_items"]

_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from warpjld.runtime.ahead import serve_items; serve_items()"
)
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # the other cores are for the caller


class LostError(Exception):
    """The process could not start, ended early, or raised what is no error of the user's: call the function here."""


class Ahead:
    """Items of ``function(*arguments)``, which runs in a process of its own.

    Args:
        place: The function's module and name. It yields what can be pickled.
        arguments: Its arguments, which can be pickled too.
    """

    def __init__(self, place: tuple[str, str], *arguments: object) -> None:
        self._popen: subprocess.Popen[bytes] | None = None
        self._items: list[bytes] = []
        self._more = threading.Condition()
        self._ended = False
        try:
            request = pickle.dumps((place, arguments))
            self._popen = subprocess.Popen(
                [sys.executable, "-P", "-c", _START, json.dumps(sys.path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=os.environ | _ONE_THREAD,
            )
        except (OSError, pickle.PicklingError, TypeError, AttributeError):
            self._ended = True
            return
        threading.Thread(target=self._read, args=(self._popen, request), daemon=True).start()

    def ready(self) -> bool:
        """Whether :meth:`item` would return, or raise, at once."""
        with self._more:
            return bool(self._items) or self._ended

    def item(self) -> Any:
        """The next item.

        Raises:
            WarpjldError: As the function does.
            LostError: There is none.
        """
        with self._more:
            self._more.wait_for(lambda: self._items or self._ended)
            if not self._items:
                raise LostError
            data = self._items.pop(0)
        try:
            kind, value = pickle.loads(data)
        except Exception as error:
            raise LostError from error
        if kind == "error":
            raise value
        return value

    def end(self) -> None:
        """End the process."""
        if self._popen is not None:
            self._popen.kill()
            self._popen.wait()

    def _read(self, process: subprocess.Popen[bytes], request: bytes) -> None:
        """Send the request and take the items, each after its length, as they come."""
        if process.stdin is None or process.stdout is None:
            raise RuntimeError("the process has no pipes")
        try:
            with suppress(OSError), process.stdin:
                process.stdin.write(request)
            with process.stdout as answers:
                while len(size := answers.read(8)) == 8:
                    data = answers.read(int.from_bytes(size, "little"))
                    with self._more:
                        self._items.append(data)
                        self._more.notify_all()
        finally:
            with self._more:
                self._ended = True
                self._more.notify_all()


def serve_items() -> None:
    """In the process: send the items of the function that stdin names; what is printed goes to stderr."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C, and ends this process
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    place, arguments = pickle.loads(sys.stdin.buffer.read())
    items = _items(imported(place), arguments)
    with suppress(BrokenPipeError, KeyboardInterrupt):
        for data in items:
            answers.write(len(data).to_bytes(8, "little") + data)
            answers.flush()


def _items(function: Callable[..., Iterator[Any]], arguments: tuple[Any, ...]) -> Iterator[bytes]:
    """Pickled items; the last may be an error of the user's. After any other exception there are no more."""
    try:
        for value in function(*arguments):
            yield _pickled(("item", value))
    except WarpjldError as error:
        yield _pickled(("error", error))
    except Exception:  # the caller calls the function itself, and meets it there
        return


def _pickled(value: object) -> bytes:
    out = io.BytesIO()
    pickle.dump(value, out, protocol=5)
    return out.getvalue()
