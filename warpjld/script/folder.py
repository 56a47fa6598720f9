"""Transactional output folder: files are made in a hidden subfolder and moved into place when all are done."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Self

from warpjld.errors import InputError
from warpjld.files.folders import make_folder
from warpjld.files.sequences import remove_former
from warpjld.files.whole_file import machine, process_runs

__all__ = ["OutputFolder"]


_LEFT = re.compile(rf"\.making([0-9]+)-{machine()}-.*")  # hidden folder of a process on this machine, with its id


class OutputFolder:
    """Context manager of an output folder; an error or Ctrl-C inside leaves the folder unchanged.

    Args:
        path: The folder; it is made if missing.

    Attributes:
        path: The folder.
        work: The hidden subfolder, while the context is active.

    Raises:
        InputError: It cannot be made or written to, or a folder stands where a file should go.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._made: list[Path] = []

    def __enter__(self) -> Self:
        missing = [p for p in (self.path, *self.path.parents) if not p.exists()]
        try:
            make_folder(self.path)
            self._made = missing
            self._sweep()
            self.work = Path(tempfile.mkdtemp(prefix=f".making{os.getpid()}-{machine()}-", dir=self.path))
        except OSError as error:
            self._remove_made()
            raise InputError(f"cannot write into this folder: {error.strerror}", path=self.path) from error
        return self

    def place(self, name: str | Path) -> Path:
        """Temporary path of the file that will be called ``name``."""
        if (self.path / name).is_dir():
            raise InputError("a folder stands where this file should go", path=self.path / name)
        path = self.work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def made(self) -> list[Path]:
        """Files made so far, relative to the folder."""
        return sorted(p.relative_to(self.work) for p in self.work.rglob("*") if p.is_file())

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._publish()
        except OSError as failure:
            raise InputError(f"cannot write: {failure.strerror}", path=failure.filename or self.path) from failure
        finally:
            shutil.rmtree(self.work, ignore_errors=True)
            if kind is not None:
                self._remove_made()

    def _sweep(self) -> None:
        """Remove hidden folders of processes that were killed."""
        for place in self.path.iterdir():
            found = _LEFT.fullmatch(place.name)
            if found and not process_runs(int(found[1])):
                shutil.rmtree(place, ignore_errors=True)

    def _publish(self) -> None:
        published: list[Path] = []
        for name in self.made():
            target = self.path / name
            target.parent.mkdir(parents=True, exist_ok=True)
            (self.work / name).replace(target)
            published.append(target)
        remove_former(published)

    def _remove_made(self) -> None:
        """Remove the folders that were created, if they are empty."""
        for path in self._made:
            try:
                path.rmdir()
            except OSError:
                return
