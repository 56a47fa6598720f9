"""Isolation of failing outputs: a file that cannot be written does not end the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Generic, Self, TypeVar

from warpjld.errors import InputError, WarpjldError

__all__ = ["Failures", "Writer"]

_FORESEEN = (WarpjldError, OSError, MemoryError)  # errors that end one output only; others are bugs
_T = TypeVar("_T")


class Failures:
    """Collects the outputs that could not be made: message by name (``found``)."""

    def __init__(self) -> None:
        self.found: dict[str, str] = {}

    @contextmanager
    def kept(self, name: str, place: Path) -> Iterator[None]:
        """Context in which an output is made; an expected error is noted and the partial file removed."""
        try:
            yield
        except _FORESEEN as error:
            self.note(name, place, error)

    def note(self, name: str, place: Path, error: BaseException) -> None:
        """Note the error of an output and remove the partial file ``place``."""
        # the temporary path must not appear in the message
        message = error.message if isinstance(error, InputError) and error.path == place else str(error)
        if isinstance(error, OSError):
            message = error.strerror or str(error)
        self.found.setdefault(name, message or "not enough memory")
        with suppress(OSError):
            place.unlink(missing_ok=True)

    def lines(self) -> list[str]:
        """One line per failed output."""
        return [f"'{name}': {message}" for name, message in self.found.items()]


class Writer(Generic[_T]):
    """Context manager around a file writer, whose failure is noted instead of raised.

    Args:
        name: Name of the output.
        place: Temporary path.
        make: Makes the writer, a context manager.
        failures: Where failures are noted.
    """

    def __init__(
        self, name: str, place: Path, make: Callable[[], AbstractContextManager[_T]], failures: Failures
    ) -> None:
        self._name, self._place, self._make, self._failures = name, place, make, failures
        self._manager: AbstractContextManager[_T] | None = None
        self._writer: _T | None = None

    def __enter__(self) -> Self:
        try:
            self._manager = self._make()
            self._writer = self._manager.__enter__()
        except _FORESEEN as error:
            self._failures.note(self._name, self._place, error)
            self._manager = None
        return self

    def do(self, work: Callable[[_T], object]) -> None:
        """Call ``work`` with the writer, unless it has failed."""
        if self._manager is None or self._writer is None:
            return
        try:
            work(self._writer)
        except _FORESEEN as error:
            manager, self._manager = self._manager, None
            with suppress(*_FORESEEN):
                manager.__exit__(type(error), error, error.__traceback__)
            self._failures.note(self._name, self._place, error)

    @property
    def works(self) -> bool:
        """Whether it has not failed."""
        return self._manager is not None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._manager is None:
            return
        try:
            self._manager.__exit__(kind, error, trace)
        except _FORESEEN as failure:
            if kind is not None:
                raise
            self._failures.note(self._name, self._place, failure)
