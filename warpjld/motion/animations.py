"""The animations of a file, by name."""

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
    """Names of the animations of a file, as ``load_motion`` takes them; none of a kind that holds a single motion.

    Raises:
        InputError: It cannot be read.
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
    """One of a file's animations, and a note where nobody said which of several.

    Args:
        wanted: A name in any case; None for the first.
        names: All of them, at least one, each different.
        path: The file, for messages.

    Raises:
        InputError: There is none of that name.
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
_USD = ("warpjld.motion.usd_animation", "usd_animation_names")
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
"""What lists the animations of each suffix."""
