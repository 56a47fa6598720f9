"""Identity of a contact simulation: hashes of specification, geometry, prescribed motion and version, part by part.

Two simulations with the same identity have the same results; where they differ, the names of the parts tell in what:
``PHYSICAL BALL: young``, ``FRICTION BALL LEFT``, ``path of LEFT``, ….
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import warpjld
from warpjld.fem import Prescribed
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.specification import ContactSpecification

__all__ = ["differences", "identity_of"]

_DIGITS = 9
"""Decimals to which real arrays are rounded before hashing (positions in m), so that rounding errors do not matter."""
_SILENT = ("where", "state")
"""Fields without influence on results."""


def identity_of(model: ContactModel, contact: ContactSpecification, frames: Sequence[float]) -> dict[str, str]:
    """Hashes by name of the part.

    Args:
        model: The contact model at its start.
        contact: The specification.
        frames: Frames to solve; prescribed motion is sampled at them and half-way between.
    """
    ends = np.array([model.start, *frames]) - model.start
    times = np.sort(np.concatenate([ends, 0.5 * (ends[:-1] + ends[1:])])).tolist()
    parts: dict[str, Any] = {"version": warpjld.__version__, "frames": [model.start, *map(float, frames)]}
    parts |= dict(_settings(contact))
    for pair, owner in zip(model.pairs, model.owners, strict=True):
        two = " ".join(sorted((owner.slave, owner.master)))
        parts[f"FRICTION {two}"] = pair.friction
        parts[f"BOND {two}"] = None if pair.bond is None else [pair.bond.normal, pair.bond.shear, *pair.bond.parted]
    out = {
        name: hashlib.sha256(json.dumps(value, default=_plain).encode()).hexdigest() for name, value in parts.items()
    }
    mesh = model.body.mesh
    for one in model.bodies:
        rows = model.spans[one.name]
        elements = mesh.elements[(mesh.elements[:, 0] >= rows.start) & (mesh.elements[:, 0] < rows.stop)]
        out[f"shape of {one.name}"] = _hash([elements, mesh.nodes[rows]])
        out[f"path of {one.name}"] = _hash(_sampled([one.prescribed(time, History()) for time in times]))
    if contact.loaded:
        loads = [model.loads_at(time, History()) for time in times]
        plain = [[list(one.pressure.items()), list(one.traction.items()), str(one.turns)] for one in loads]
        forces = [np.empty((0, 3)) if one.nodal is None else one.nodal for one in loads]
        out["loads"] = hashlib.sha256((json.dumps(plain) + _hash(forces)).encode()).hexdigest()
    for name, obstacle in model.obstacles.items():
        out[f"shape of {name}"] = _hash([obstacle.mesh(0.0)[1]])
        out[f"path of {name}"] = _hash([np.asarray(obstacle.mesh(time)[0]) for time in times])
    return out


def differences(one: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """Names of the parts in which two identities differ."""
    return [name for name in {**one, **other} if one.get(name) != other.get(name)]


def _settings(contact: ContactSpecification) -> Iterator[tuple[str, Any]]:
    """Settings of the specification by command and field."""
    records: dict[str, Any] = {f"PHYSICAL {name}": one for name, one in contact.physical.items()}
    records |= {f"FLESH {name}": one for name, one in contact.flesh.items()}
    records |= {} if contact.pressing is None else {"PRESS": contact.pressing}
    for command, record in records.items():
        for one in fields(record):
            if one.name not in _SILENT:
                yield f"{command}: {one.name}", getattr(record, one.name)
    for grip in contact.grips:
        for one in fields(grip):
            if one.name not in _SILENT:
                yield f"grip at frame {grip.first:g}: {one.name}", getattr(grip, one.name)
    yield "GRAVITY", contact.pull
    yield "STRENGTH", contact.strength
    yield "GRASP", list(contact.grasped)


def _plain(value: Any) -> Any:
    """JSON-compatible form of a value: the name of a path, the fields of a dataclass."""
    if isinstance(value, Path):
        return value.name
    return {one.name: getattr(value, one.name) for one in fields(value) if one.name not in _SILENT}


def _sampled(known: Sequence[Prescribed]) -> Iterator[NDArray[Any]]:
    for one in known:
        yield one.degrees
        yield one.values


def _hash(arrays: Any) -> str:
    """SHA-256 of arrays; real ones are rounded."""
    out = hashlib.sha256()
    for array in arrays:
        real = np.issubdtype(array.dtype, np.floating)
        plain = np.round(array.astype(np.float64), _DIGITS) + 0.0 if real else array.astype(np.int64)
        out.update(f"{plain.shape}".encode())
        out.update(np.ascontiguousarray(plain).tobytes())
    return out.hexdigest()
