"""Hash of the content of a rig or motion file, including files it refers to."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from urllib.parse import unquote

from warpjld.errors import InputError
from warpjld.files.manifest import file_hash

__all__ = ["content_hash", "files_of"]

_USD = (".usd", ".usda", ".usdc")


def content_hash(path: Path) -> str:
    """SHA-256 of a file; if it refers to others, of the hashes of all.

    Raises:
        OSError: The file itself cannot be read; others that cannot be read count as missing.
    """
    own = file_hash(path)
    others = files_of(path)
    if not others:
        return own
    return hashlib.sha256("\n".join([own, *map(_hash_or_missing, others)]).encode()).hexdigest()


def files_of(path: Path) -> list[Path]:
    """Files that contain part of a file's rig or motion: the buffers of a .gltf, the layers of a USD stage.

    Textures are not included, since results do not depend on them. Invalid files give an empty list; their reader
    reports the error.
    """
    suffix = path.suffix.lower()
    if suffix == ".gltf":
        return _buffers(path)
    if suffix in _USD:
        return _layers(path)
    return []


def _hash_or_missing(path: Path) -> str:
    try:
        return file_hash(path)
    except OSError:
        return "missing"


def _buffers(path: Path) -> list[Path]:
    try:
        buffers = json.loads(path.read_bytes()).get("buffers", [])
        uris = [buffer.get("uri") for buffer in buffers]
    except (OSError, ValueError, RecursionError, AttributeError, TypeError):
        return []
    names = [unquote(uri) for uri in uris if isinstance(uri, str) and not uri.startswith("data:") and "\0" not in uri]
    return [path.parent / name for name in names]


def _layers(path: Path) -> list[Path]:
    from warpjld.io.usd.separate_rig import layers_of

    try:
        return layers_of(path)
    except InputError:  # its reader refuses it with the reason
        return []
