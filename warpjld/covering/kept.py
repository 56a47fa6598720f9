"""Bindings kept in files: what was found out about a rig once need not be found out again by the next process.

A file holds the domains and the packed operators with a hash of all that they follow from: the surface, the skeleton,
the parameters, the settings and the program's version. A file of anything else is never used.
"""

from __future__ import annotations

import hashlib
import os
import sys
import zipfile
from dataclasses import astuple, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from warpjld import __version__
from warpjld.covering.covering import Covering, bind, bind_rig
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.runs import Columns, Runs
from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["CACHE_VARIABLE", "bind_kept", "cache_folder", "load_binding", "save_binding"]

CACHE_VARIABLE = "WARPJLD_CACHE"
"""Environment variable: the folder in which bindings are kept, or ``off``."""

_FORMAT = "warpjld binding 1"
_MOST = 32  # files in the cache; the ones longest unused go
_ARRAYS = ("tiles", "runs", "slots", "coefficients", "order")


def bind_kept(
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
    method: Literal["smooth", "paper"] = "smooth",
    path: Path | None = None,
) -> tuple[Covering, tuple[str, ...]]:
    """``bind_rig``, out of a file where there is one that fits; and what is to be told of it.

    Args:
        rig: The rig; likewise ``skeleton``, ``parameters``, ``domains`` and ``method`` as of ``bind_rig``.
        path: A file that ``save_binding`` wrote; by default one in the cache, which is written if it is missing.
    """
    how: dict[str, Any] = {"skeleton": skeleton, "parameters": parameters, "domains": domains}
    folder = cache_folder()
    if method != "smooth" or (path is None and folder is None):
        return bind_rig(rig, method=method, **how), ()
    notes: tuple[str, ...] = ()
    key = _key(rig, **how)
    file = path if path is not None else folder / f"{key}.npz"  # type: ignore[operator]
    if path is not None or file.exists():
        try:
            covering = load_binding(file, rig, **how)
            if path is None:
                os.utime(file)
            return covering, ()
        except (InputError, OSError) as error:
            notes = (f"binding made anew: {error}",)
    covering = bind_rig(rig, method=method, **how)
    if path is None:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            save_binding(file, covering, rig, domains=domains)
            _tidy(file.parent)
        except OSError:  # a cache that cannot be written is none
            pass
    return covering, notes


def save_binding(
    path: Path, covering: Covering, rig: Rig, *, domains: Literal["geometry", "skin"] = "geometry"
) -> None:
    """Keep the binding of a rig in a file, written beside it and renamed.

    Raises:
        OSError: It cannot be written.
    """
    runs = covering.runs
    key = _key(rig, skeleton=covering.skeleton, parameters=covering.parameters, domains=domains)
    arrays = {name: getattr(runs, name) for name in _ARRAYS}
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with beside.open("wb") as file:
            np.savez(
                file,
                format=np.array(_FORMAT),
                key=np.array(key),
                columns=np.array(astuple(runs.columns)),
                domains=covering.domains,
                **arrays,
            )
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def load_binding(
    path: Path,
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
) -> Covering:
    """The binding of this rig with these settings out of a file.

    Raises:
        InputError: No such file, not a binding, or that of something else.
    """
    key = _key(rig, skeleton=skeleton, parameters=parameters, domains=domains)
    try:
        with np.load(path, allow_pickle=False) as file:
            if str(file["format"]) != _FORMAT:
                raise InputError("not a binding of this version", path=path)
            if str(file["key"]) != key:
                raise InputError("is the binding of another rig, other settings or another version", path=path)
            weights = file["domains"]
            runs = Runs(Columns(*file["columns"].tolist()), **{name: file[name] for name in _ARRAYS})
    except FileNotFoundError:
        raise InputError("no such file", path=path) from None
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"not a binding as 'warpjld bind' writes them ({error})", path=path) from None
    chosen = rig.skeleton if skeleton is None else skeleton
    covering = bind(chosen, rig.surface, parameters=parameters, rigid=rig.rigid, domains=weights)
    covering.runs = runs
    return covering


def cache_folder() -> Path | None:
    """Where bindings are kept; None where they are not."""
    stated = os.environ.get(CACHE_VARIABLE)
    if stated is not None:
        return None if stated.strip().lower() in ("", "0", "off", "no") else Path(stated)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "warpjld" / "bindings"


def _key(
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: str = "geometry",
) -> str:
    skeleton = rig.skeleton if skeleton is None else skeleton
    digest = hashlib.sha256(f"{_FORMAT} {__version__} {_sources()} {domains}".encode())
    surface = (rig.surface.vertices, rig.surface.faces)
    chosen = default_parameters(skeleton) if parameters is None else parameters
    for part in (surface, skeleton, chosen, rig.rigid, rig.skin if domains == "skin" else None):
        _feed(digest, part)
    return digest.hexdigest()


@cache
def _sources() -> str:
    """Hash of the programs that bind: a version under way changes without its number."""
    import warpjld_kernels

    import warpjld

    digest = hashlib.sha256()
    for folder in (Path(warpjld.__path__[0]), Path(warpjld_kernels.__path__[0])):
        for file in sorted(folder.rglob("*.py")):
            digest.update(file.relative_to(folder).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Every number that a value holds, and what it is: values that differ feed different bytes."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value):
        for field in fields(value):
            digest.update(field.name.encode())
            _feed(digest, getattr(value, field.name))
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)}".encode())
        for part in value:
            _feed(digest, part)
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())


def _tidy(folder: Path) -> None:
    files = sorted(folder.glob("*.npz"), key=lambda file: file.stat().st_mtime, reverse=True)
    for old in files[_MOST:]:
        old.unlink(missing_ok=True)
