"""Base colour texture of an OBJ file, found by its material library (MTL)."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.io.gltf.schema import inside_folder

__all__ = ["obj_texture"]


def obj_texture(path: Path) -> tuple[bytes | None, str]:
    """Encoded image of the single texture (``map_Kd``) of an OBJ file, and a warning.

    The image is None if the file has several materials or if its material library or texture is missing. The warning is
    empty if there is nothing to report.
    """
    libraries, used = [], set()
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            word, _, rest = line.partition(" ")
            if word == "mtllib":
                libraries.append(rest.strip())
            elif word == "usemtl":
                used.add(rest.strip())
    pictures: dict[str, str] = {}
    try:
        for library in libraries:
            pictures |= _pictures(path.parent / inside_folder(library))
        wanted = {pictures[name] for name in used if name in pictures}
        if len(wanted) == 1 and len(used) == 1:
            return read_bytes(path.parent / inside_folder(wanted.pop())), ""
    except (InputError, OSError) as error:
        return None, f"its texture is not drawn: {error}"
    return None, "its textures are not drawn: it has several materials" if wanted else ""


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
