"""UsdSkel rigs, and the layers of a stage, read in a process of its own: see :mod:`warpjld.runtime.separate`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import MissingExtraError
from warpjld.geometry.surface import Part
from warpjld.io.source import SourceRig
from warpjld.io.usd.skin import read_usd_rig
from warpjld.io.usd.stage import check_usd_content
from warpjld.io.usd.text_layer import layer_in_parts
from warpjld.runtime.separate import separately
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["PER_BYTE", "layers_of", "load_usd_rig", "need_usd"]

PER_BYTE = 20
"""Memory for each byte of a file: its arrays as double precision, twice, are about ten times as large as single
precision with 16-bit indices."""
_ARRAYS = ("vertices", "faces", "uv", "corner_uv", "polygons", "joints", "weights", "rigid")
_FILE = "rig.npz"
_HERE = "warpjld.io.usd.separate_rig"


def load_usd_rig(path: str | Path) -> SourceRig:
    """As :func:`~warpjld.io.usd.skin.read_usd_rig`, in a process of its own.

    Raises:
        InputError: Not a USD file, no skeleton, or invalid skin data; or OpenUSD crashed or exceeded a limit.
        MissingExtraError: OpenUSD is not installed.
    """
    path = Path(path)
    need_usd()
    with separately((_HERE, "leave_rig"), path, "USD", per_byte=PER_BYTE) as answer:
        told = answer.value
        with np.load(answer.folder / _FILE) as file:
            arrays = dict(file)
    return SourceRig(
        path=path,
        tree=SourceTree(tuple(told["names"]), arrays.pop("parents"), arrays.pop("frames")),
        parts=tuple(Part(name, slice(*vertices), slice(*faces)) for name, vertices, faces in told["parts"]),
        metres=told["metres"],
        up=told["up"],
        notes=tuple(told["notes"]),
        **arrays,
    )


def layers_of(path: Path) -> list[Path]:
    """The other layers of a stage, sorted; none where OpenUSD is not installed.

    Raises:
        InputError: Not a USD file.
    """
    if find_spec("pxr") is None:
        return []
    with separately((_HERE, "name_layers"), path, "USD", per_byte=PER_BYTE) as answer:
        return [Path(layer) for layer in answer.value]


def need_usd() -> None:
    """Make sure that OpenUSD is installed.

    Raises:
        MissingExtraError: It is not.
    """
    if find_spec("pxr") is None:
        raise MissingExtraError("USD", "usd")


def leave_rig(folder: Path, path: Path) -> dict[str, Any]:
    """In the process: write the arrays of a rig to the folder, and return the rest."""
    rig = read_usd_rig(path)
    arrays = {name: getattr(rig, name) for name in _ARRAYS if getattr(rig, name) is not None}
    np.savez(folder / _FILE, parents=rig.tree.parents, frames=rig.tree.frames, **arrays)
    spans = [
        (part.name, (part.vertices.start, part.vertices.stop), (part.faces.start, part.faces.stop))
        for part in rig.parts
    ]
    return {"names": rig.tree.names, "parts": spans, "metres": rig.metres, "up": rig.up, "notes": rig.notes}


def name_layers(folder: Path, path: Path) -> list[str]:
    """In the process: the files of a stage's other layers."""
    from pxr import Sdf, UsdUtils

    check_usd_content(path)
    read = layer_in_parts(path, samples=False)  # OpenUSD takes a layer that exists; numbers name no others
    layers, _, _ = UsdUtils.ComputeAllDependencies(Sdf.AssetPath(str(path)))
    del read
    return [
        str(one) for one in sorted({Path(one.realPath).resolve() for one in layers if one.realPath} - {path.resolve()})
    ]
