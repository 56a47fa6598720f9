"""Integrity check of Warp's kernel cache: damaged native code must not be run.

Checksums of a module's files are stored next to them when they are first found intact. If a file has changed since, or
is truncated, the folder of its module is removed, and the module is compiled again when needed.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import struct
import sys
from contextlib import suppress
from pathlib import Path

from warpjld.files.whole_file import whole_file

__all__ = ["remove_damaged_kernels"]

_SUMS = "warpjld.sums.json"
_MODULE = re.compile(r"wp_warpjld_kernels\..+_[0-9a-f]+")
"""Names of folders of this package's modules; modules being compiled have longer ones."""
_LOADED = (".o", ".ptx", ".cubin", ".meta")


def remove_damaged_kernels(cache: Path) -> tuple[list[str], bool]:
    """Check the kernels of warpjld in a cache: store checksums of new modules, and remove damaged ones.

    Returns:
        Names of the damaged modules, and whether all of them were removed.
    """
    found, gone = [], True
    with suppress(OSError):  # a cache that cannot be listed is treated as empty
        for folder in sorted(place for place in cache.iterdir() if _MODULE.fullmatch(place.name)):
            if _is_whole(folder):
                continue
            found.append(folder.name.removeprefix("wp_warpjld_kernels.").rpartition("_")[0])
            shutil.rmtree(folder, ignore_errors=True)
            gone = gone and not folder.exists()
    return found, gone


def _is_whole(folder: Path) -> bool:
    """Whether all files that would be loaded from a module's folder match their checksums."""
    known = _known(folder)
    sums = {}
    try:
        for file in folder.iterdir():
            if file.suffix in _LOADED:
                content = file.read_bytes()
                sums[file.name] = hashlib.blake2b(content, digest_size=16).hexdigest()
                if file.name in known and sums[file.name] != known[file.name]:
                    return False
                if file.name not in known and not _is_sound(file.suffix, content):
                    return False
    except FileNotFoundError:  # another process removes or replaces it
        return True
    except OSError:
        return False
    if sums != known:
        with suppress(OSError), whole_file(folder / _SUMS) as part:
            part.write_text(json.dumps(sums), encoding="utf-8")
    return True


def _known(folder: Path) -> dict[str, str]:
    try:
        content = json.loads((folder / _SUMS).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _is_sound(suffix: str, content: bytes) -> bool:
    """Whether a file is of the expected type and not truncated, as far as that can be checked."""
    if suffix == ".meta":
        try:
            return isinstance(json.loads(content), dict)
        except (ValueError, RecursionError):
            return False
    if suffix != ".o" or not sys.platform.startswith("linux"):
        return bool(content)
    if len(content) < 64 or content[:5] != b"\x7fELF\x02":
        return False
    begin, size, count = struct.unpack_from("<Q", content, 40)[0], *struct.unpack_from("<HH", content, 58)
    return bool(begin + size * count <= len(content))
