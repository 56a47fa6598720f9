"""Bindings stored in files, so that a rig that was bound before is loaded instead of bound again.

A file holds the domains, the vertices' coordinates on their segments, the fields and the packed operators, with a hash
of all inputs (:mod:`warpjld.covering.kept_key`). A file with another hash is never used.
"""

from __future__ import annotations

import zipfile
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.checked_binding import check_anchors, check_array, check_runs, check_sparse
from warpjld.covering.covering import Covering
from warpjld.covering.fields import Fields
from warpjld.covering.kept_key import binding_key
from warpjld.covering.operators import fans
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.runs import Columns, Runs
from warpjld.covering.surface_binding import bind_rig
from warpjld.errors import InputError
from warpjld.files.array_file import read_arrays
from warpjld.files.kept_files import keep, kept_folder, used
from warpjld.files.whole_file import whole_file
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["bind_kept", "load_binding", "save_binding"]

_FORMAT = "warpjld binding 3"
_RUNS = ("tiles", "runs", "slots", "coefficients", "order")
_ANCHORS = tuple(field.name for field in fields(Anchors) if field.name != "rest")  # ``rest`` is in the rig's surface
_PARAMETERS = tuple(field.name for field in fields(Parameters))
_FIELDS = tuple(field.name for field in fields(Fields))
_SPARSE = ("data", "indices", "indptr", "shape")


def bind_kept(
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
    method: Literal["smooth", "paper"] = "smooth",
    path: Path | None = None,
) -> tuple[Covering, tuple[str, ...]]:
    """``bind_rig``, or the same binding from a file where a valid one exists.

    Args:
        rig: The rig; likewise ``skeleton``, ``parameters``, ``domains`` and ``method`` as of ``bind_rig``.
        path: A file that ``save_binding`` wrote; by default one in the cache, which is written if it is missing.

    Returns:
        The covering, and notes for the user: why an existing file could not be used.
    """
    how: dict[str, Any] = {"skeleton": skeleton, "parameters": parameters, "domains": domains}
    folder = kept_folder()
    if method != "smooth" or (path is None and folder is None):
        return bind_rig(rig, method=method, **how), ()
    notes: tuple[str, ...] = ()
    key = binding_key(rig, **how)
    file = path if path is not None else folder / f"{key}.npz"  # type: ignore[operator]
    if path is not None or file.exists():
        try:
            covering = _load(file, key, rig, skeleton)
            if path is None:
                used(file)
            return covering, ()
        except (InputError, OSError) as error:
            notes = (f"binding made anew: {error}",)
    covering = bind_rig(rig, method=method, **how)
    if path is None:
        keep(file, lambda place: _write(place, key, covering))
    return covering, notes


def save_binding(
    path: Path,
    covering: Covering,
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
) -> None:
    """Write the binding that ``bind_rig`` made of a rig with these settings to a file (atomically).

    Raises:
        OSError: The file cannot be written.
    """
    key = binding_key(rig, skeleton=skeleton, parameters=parameters, domains=domains)
    with whole_file(path) as part:
        _write(part, key, covering)


def load_binding(
    path: Path,
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
) -> Covering:
    """Read the binding of this rig with these settings from a file.

    Raises:
        InputError: No such file, not a binding, or one of another rig, other settings or another version.
    """
    return _load(path, binding_key(rig, skeleton=skeleton, parameters=parameters, domains=domains), rig, skeleton)


def _write(path: Path, key: str, covering: Covering) -> None:
    """Write an NPZ archive of a binding with its key."""
    parts = {"runs": (covering.runs, _RUNS), "anchors": (covering.anchors, _ANCHORS)}
    parts["parameters"] = (covering.parameters, _PARAMETERS)
    parts |= {f"fields.{kind}": (getattr(covering.fields, kind), _SPARSE) for kind in _FIELDS}
    arrays: dict[str, Any] = {
        f"{part}.{name}": np.asarray(getattr(value, name)) for part, (value, names) in parts.items() for name in names
    }
    arrays |= {"columns": np.array(astuple(covering.runs.columns)), "domains": covering.domains}
    arrays |= {"swelling": covering.swelling, "thickening": covering.thickening}
    with path.open("wb") as file:
        np.savez(file, format=np.array(_FORMAT), key=np.array(key), **arrays)


def _load(path: Path, key: str, rig: Rig, skeleton: Skeleton | None) -> Covering:
    """Read an NPZ archive of a binding; InputError where it is none, or has another key."""
    try:
        if path.is_file() and not zipfile.is_zipfile(path):
            raise ValueError("not an NPZ archive")
        if not path.exists():
            raise InputError("no such file", path=path)
        arrays = read_arrays(path)
        if str(arrays["format"]) != _FORMAT:
            raise InputError("not a binding of this version", path=path)
        if str(arrays["key"]) != key:
            raise InputError("is the binding of another rig, other settings or another version", path=path)
        anchors = Anchors(rest=rig.surface.vertices, **_part(arrays, "anchors", _ANCHORS))
        runs = Runs(Columns(*arrays["columns"].tolist()), **_part(arrays, "runs", _RUNS))
        parameters = Parameters(**_part(arrays, "parameters", _PARAMETERS))
        kept = _KeptFields({kind: _part(arrays, f"fields.{kind}", _SPARSE) for kind in _FIELDS})
        domains, volume = arrays["domains"], (arrays["swelling"], arrays["thickening"])
        chosen = rig.skeleton if skeleton is None else skeleton
        covering = Covering(chosen, rig.surface, parameters, fans(chosen), domains, anchors)
        _check(covering, runs, kept, *volume)
    except InputError as error:
        raise InputError(error.message, path=path) from None
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"not a binding as 'warpjld bind' writes them ({error})", path=path) from None
    return covering.keeping(runs, kept, *volume)


def _check(
    covering: Covering,
    runs: Runs,
    kept: _KeptFields,
    swelling: NDArray[np.float64],
    thickening: NDArray[np.float64],
) -> None:
    """Check that a stored binding matches the rig and that its indices are valid; else ValueError or InputError."""
    skeleton, count, segments = covering.skeleton, len(covering.surface.vertices), len(covering.anchors.ends)
    joints, stations = len(skeleton), STATIONS * len(covering.anchors.pairs)
    for name, array in vars(default_parameters(skeleton)).items():
        check_array(name, getattr(covering.parameters, name), array.shape, np.float64)
    covering.parameters.check(skeleton)
    check_anchors(covering.anchors, skeleton)
    check_runs(runs, skeleton, covering.anchors, count)
    widths = (joints, 2 * joints, joints, joints, stations, segments)
    for kind, width in zip(_FIELDS, widths, strict=True):
        check_sparse(kind, kept.arrays[kind], (count, width))
    check_array("domains", covering.domains, (count, len(covering.fans)), np.float64)
    check_array("swelling", swelling, (joints,), np.float64)
    check_array("thickening", thickening, (len(covering.anchors.pairs),), np.float64)


def _part(arrays: dict[str, NDArray[Any]], prefix: str, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    return {name: arrays[f"{prefix}.{name}"] for name in names}


@dataclass(frozen=True, eq=False)
class _KeptFields:
    """Fields as plain arrays, from which the call makes SciPy's sparse matrices (SciPy is imported only then)."""

    arrays: dict[str, dict[str, NDArray[Any]]]

    def __call__(self) -> Fields:
        import scipy.sparse as sp

        parts = (self.arrays[kind] for kind in _FIELDS)
        return Fields(*(sp.csr_array((p["data"], p["indices"], p["indptr"]), shape=tuple(p["shape"])) for p in parts))
