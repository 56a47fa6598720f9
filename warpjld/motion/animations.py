"""Names of the animations in a file, and the choice of one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.runtime.lazily import imported
from warpjld.suggest import one_of

__all__ = ["animation_names", "choose_animation"]


def animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of a file's animations, as ``load_motion`` takes them; empty for formats that hold a single motion.

    Raises:
        InputError: The file cannot be read.
    """
    path = Path(path)
    lister = _LISTERS.get(path.suffix.lower())
    if lister is None:
        return ()
    check_input(path)
    read: Callable[[Path], tuple[str, ...]] = imported(lister)
    with reading(path, f"animations ({path.suffix.lower()})"):
        return read(path)


def choose_animation(wanted: str | None, names: tuple[str, ...], path: Path) -> tuple[str, tuple[str, ...]]:
    """Name of the chosen animation, and a note if it was chosen by default among several.

    Args:
        wanted: A name in any case; None for the first.
        names: Names of all animations, at least one, all different.
        path: The file, for messages.

    Raises:
        InputError: No animation has that name, or several have it in other cases.
    """
    if wanted is None:
        if len(names) == 1:
            return names[0], ()
        return names[0], (f"animation '{names[0]}', the first of {len(names)}: {', '.join(names)}",)
    if wanted in names:
        return wanted, ()
    alike = [name for name in names if name.lower() == wanted.lower()]
    if len(alike) == 1:
        return alike[0], ()
    if alike:
        raise InputError(f"animation '{wanted}' may be {' or '.join(alike)}", path=path)
    raise InputError(f"no animation '{wanted}' in this file{one_of(wanted, names)}", path=path)


_GLTF = ("warpjld.motion.gltf_animation", "gltf_animation_names")
_USD = ("warpjld.motion.separate_usd", "load_usd_animation_names")
_LISTERS = {
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".vrma": _GLTF,
    ".fbx": ("warpjld.motion.fbx_animation", "fbx_animation_names"),
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
    ".usdz": _USD,
}
"""Suffix → function that lists the file's animations."""
