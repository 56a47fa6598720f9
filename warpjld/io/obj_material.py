"""Base colour textures of an OBJ file, found by its material libraries (MTL)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.io.gltf.schema import inside_folder

__all__ = ["obj_textures"]


def obj_textures(folder: Path, libraries: Sequence[str], used: Collection[str]) -> tuple[dict[str, bytes], str]:
    """Encoded images of the textures (``map_Kd``) of an OBJ file's materials, and a warning.

    Args:
        folder: Folder of the file.
        libraries: Names of its material libraries.
        used: Names of the materials that its faces have.

    Returns:
        Images by the material's name, of materials that have a texture that can be read, and what could not be read,
        empty if there is nothing to report.
    """
    pictures: dict[str, str] = {}
    images: dict[str, bytes] = {}
    wrong = ""
    for library in libraries:
        try:
            pictures |= _pictures(folder / inside_folder(library))
        except (InputError, OSError) as error:
            wrong = wrong or f"its texture is not drawn: {error}"
    for name in sorted(set(used) & pictures.keys()):
        try:
            images[name] = read_bytes(folder / inside_folder(pictures[name]))
        except (InputError, OSError) as error:
            wrong = wrong or f"its texture is not drawn: {error}"
    return images, wrong


def _pictures(library: Path) -> dict[str, str]:
    """Texture file names of a library's materials, by material name."""
    out, name = {}, ""
    for line in read_bytes(library).decode("utf-8", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            name = " ".join(words[1:])
        elif words[:1] == ["map_Kd"] and len(words) > 1:
            out[name] = words[-1]
    return out
