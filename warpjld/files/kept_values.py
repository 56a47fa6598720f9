"""Cache of computed values, as nested dataclasses of arrays in NPZ files, keyed by a hash of their inputs."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from warpjld import __version__
from warpjld.files.kept_files import keep, kept_folder, used
from warpjld.files.sources import hash_of_sources

__all__ = ["hash_of", "kept_value"]

_FORMAT = "warpjld values 2"
_Value = TypeVar("_Value")


def kept_value(
    what: str, key: str, classes: Sequence[type], make: Callable[[], _Value], *, modules: tuple[str, ...]
) -> tuple[_Value, tuple[str, ...]]:
    """Result of ``make``, read from the cache if it was computed before; and messages about the cache.

    Args:
        what: Kind of value, one word, for messages and the file name.
        key: Hash of the inputs of ``make`` (see ``hash_of``); a hash of the source code is added.
        classes: Dataclasses it consists of, besides arrays, tuples, dictionaries, slices, bytes, numbers and strings.
        make: Function that computes the value.
        modules: Glob patterns of the package's modules that ``make`` depends on; all kernels are included.
    """
    folder = kept_folder()
    if folder is None:
        return make(), ()
    key = hash_of(__version__, hash_of_sources(modules), what, key)
    file = folder / f"{what}-{key}.npz"
    notes: tuple[str, ...] = ()
    if file.exists():
        try:
            value = _read(file, key, classes)
        except (OSError, ValueError, KeyError, EOFError, TypeError, IndexError, zipfile.BadZipFile) as error:
            notes = (f"{what} made anew: {file} is damaged ({error})",)
        else:
            used(file)
            return value, ()
    value = make()
    keep(file, lambda place: _write(place, key, value))
    return value, notes


def hash_of(*values: Any) -> str:
    """Hash of all numbers, strings and arrays in nested values, including their types."""
    arrays: list[NDArray[Any]] = []
    digest = hashlib.sha256(json.dumps([_plain(value, arrays) for value in values]).encode())
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _plain(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """JSON-compatible form of a value; arrays are appended to a list, and replaced by their index in it."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return ["array", len(arrays) - 1]
    if is_dataclass(value):
        name = type(value).__name__
        return ["class", name, {one.name: _plain(getattr(value, one.name), arrays) for one in fields(value)}]
    if isinstance(value, (tuple, list)):
        return ["tuple", [_plain(one, arrays) for one in value]]
    if isinstance(value, dict):
        return ["dict", [[name, _plain(one, arrays)] for name, one in value.items()]]
    if isinstance(value, slice):
        return ["slice", [_plain(one, arrays) for one in (value.start, value.stop, value.step)]]
    if isinstance(value, bytes):
        arrays.append(np.frombuffer(value, dtype=np.uint8))
        return ["bytes", len(arrays) - 1]
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def _value(plain: Any, arrays: list[NDArray[Any]], classes: dict[str, type]) -> Any:
    if not isinstance(plain, list):
        return plain
    kind, *rest = plain
    if kind == "array":
        return arrays[rest[0]]
    if kind == "bytes":
        return arrays[rest[0]].tobytes()
    if kind == "slice":
        return slice(*rest[0])
    if kind == "class":
        return classes[rest[0]](**{name: _value(one, arrays, classes) for name, one in rest[1].items()})
    if kind == "tuple":
        return tuple(_value(one, arrays, classes) for one in rest[0])
    return {name: _value(one, arrays, classes) for name, one in rest[0]}


def _write(place: Path, key: str, value: Any) -> None:
    arrays: list[NDArray[Any]] = []
    text = json.dumps(_plain(value, arrays))
    with place.open("wb") as file:
        named = {f"array{k}": array for k, array in enumerate(arrays)}
        np.savez(file, format=np.array(_FORMAT), key=np.array(key), text=np.array(text), **named)  # type: ignore[arg-type]


def _read(place: Path, key: str, classes: Sequence[type]) -> Any:
    if not zipfile.is_zipfile(place):
        raise ValueError("no NPZ archive")
    with np.load(place, allow_pickle=False) as file:
        if str(file["format"]) != _FORMAT or str(file["key"]) != key:
            raise ValueError("it holds something else")
        arrays = [file[f"array{k}"] for k in range(len(file.files) - 3)]
        return _value(json.loads(str(file["text"])), arrays, {one.__name__: one for one in classes})
