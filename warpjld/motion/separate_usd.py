"""UsdSkel animations, read in a process of its own: see :mod:`warpjld.runtime.separate`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from warpjld.files.spilled_rows import SpilledRows
from warpjld.io.usd.separate_rig import PER_BYTE, need_usd
from warpjld.motion.joint_animation import JointAnimation, spilled_animation
from warpjld.motion.usd_animation import read_usd_animation, usd_animation_names
from warpjld.runtime.separate import separately
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["load_usd_animation", "load_usd_animation_names"]

_TREE, _FRAMES = "tree.npz", "frames"
_HERE = "warpjld.motion.separate_usd"


def load_usd_animation_names(path: str | Path) -> tuple[str, ...]:
    """As :func:`~warpjld.motion.usd_animation.usd_animation_names`, in a process of its own.

    Raises:
        InputError: Not a USD file; or OpenUSD crashed or exceeded a limit.
        MissingExtraError: OpenUSD is not installed.
    """
    need_usd()
    with separately((_HERE, "tell_names"), Path(path), "USD", per_byte=PER_BYTE) as answer:
        return tuple(answer.value)


def load_usd_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """As :func:`~warpjld.motion.usd_animation.read_usd_animation`, in a process of its own.

    Raises:
        InputError: Not a USD file, no skeleton, no such animation; or OpenUSD crashed or exceeded a limit.
        MissingExtraError: OpenUSD is not installed.
    """
    need_usd()
    with separately((_HERE, "leave_animation"), Path(path), "USD", rate, name, per_byte=PER_BYTE) as answer:
        told = answer.value
        with np.load(answer.folder / _TREE) as file:
            tree = SourceTree(tuple(told["names"]), file["parents"], file["frames"])
        rows = SpilledRows(16 * len(tree))
        rows.extend_from(answer.folder / _FRAMES)
    nothing = np.zeros((0, len(tree), 4, 4))
    notes, warnings = tuple(told["notes"]), tuple(told["warnings"])
    return spilled_animation(
        JointAnimation(tree, nothing, told["rate"], told["title"], notes, warnings, told["up"]), rows
    )


def tell_names(folder: Path, path: Path) -> tuple[str, ...]:
    """In the process: names of a stage's animations."""
    return usd_animation_names(path)


def leave_animation(folder: Path, path: Path, rate: float | None, name: str | None) -> dict[str, Any]:
    """In the process: write joints and frames to the folder, and return the rest."""
    animation = read_usd_animation(path, rate=rate, name=name)
    np.savez(folder / _TREE, parents=animation.tree.parents, frames=animation.tree.frames)
    with (folder / _FRAMES).open("wb") as file:
        for _, block in animation.blocks():
            file.write(np.ascontiguousarray(block.worlds, dtype=np.float64).tobytes())
    told = {key: getattr(animation, key) for key in ("rate", "title", "notes", "warnings", "up")}
    return told | {"names": animation.tree.names}
