"""Nested dataclasses of arrays in one NPZ file of the cache, found again by a hash of all that they follow from."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from warpjld import __version__
from warpjld.files.kept_files import keep, kept_folder, used

__all__ = ["hash_of", "kept_sources", "kept_value"]

_FORMAT = "warpjld values 1"
_Value = TypeVar("_Value")

# whatever computes what is kept: more than each value needs, so that none is ever out of date
_MODULES = ("*.py", "fem/**/*.py", "grasp/objects.py", "rig/*.py", "simulation/**/*.py", "skeleton/**/*.py")


def kept_value(
    what: str, key: str, classes: Sequence[type], make: Callable[[], _Value]
) -> tuple[_Value, tuple[str, ...]]:
    """What ``make`` returns, out of a file of the cache where it was made before; and what is to be told of that.

    Args:
        what: What it is, for people and for the file's name: a word.
        key: Hash of what is given to ``make`` (see ``hash_of``); that of the programs is added.
        classes: Dataclasses it consists of, beside arrays, tuples, dictionaries, numbers and strings.
        make: Makes it.
    """
    folder = kept_folder()
    if folder is None:
        return make(), ()
    key = hash_of(__version__, _hash_of_sources(), what, key)
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
    """Hash of every number, string and array in nested values, and of what each is."""
    arrays: list[NDArray[Any]] = []
    digest = hashlib.sha256(json.dumps([_plain(value, arrays) for value in values]).encode())
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def kept_sources() -> Iterator[Path]:
    """Files whose content a kept value depends on, always in the same order."""
    import warpjld_kernels

    import warpjld

    package, kernels = Path(warpjld.__path__[0]), Path(warpjld_kernels.__path__[0])
    yield from sorted({file for pattern in _MODULES for file in package.glob(pattern)})
    yield from sorted(kernels.glob("*.py"))


@cache
def _hash_of_sources() -> str:
    """Of their content: a version under way changes without its number."""
    digest = hashlib.sha256()
    for file in kept_sources():
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _plain(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """A value as JSON has it; its arrays are added to a list, and stand in it by their place there."""
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
