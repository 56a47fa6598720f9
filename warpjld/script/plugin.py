"""Loading of Python files that add commands."""

from __future__ import annotations

import importlib.util
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType

from warpjld.errors import InputError, WarpjldError

__all__ = ["load_commands"]


def load_commands(path: Path) -> None:
    """Import a Python file, so that its ``@command`` decorators run (R88).

    Raises:
        InputError: It cannot be read, or raises an exception; names the line.
    """
    if not path.is_file():
        raise InputError("cannot read commands: no such file", path=path)
    name = f"warpjld_commands_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path, loader=_Uncached(name, str(path)))
    if path.suffix != ".py" or spec is None or spec.loader is None:
        raise InputError("want a Python file (.py)", path=path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InputError(f"not Python: {error.msg}", path=path, line=error.lineno, column=error.offset) from error
    except WarpjldError:
        raise
    except Exception as error:
        raise InputError(f"{type(error).__name__}: {error}", path=path, line=_line(error, path)) from error


class _Uncached(SourceFileLoader):
    """Loader without bytecode, which is taken for a file's if size and time in seconds are: a file that is changed and
    tried at once would be the old one."""

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.get_data(self.path), self.path)


def _line(error: BaseException, path: Path) -> int | None:
    """Line in the file at which an error occurred, or None."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
