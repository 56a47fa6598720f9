"""Manifest of a study: hashes of inputs and settings, and software versions."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from warpjld.files.whole_file import whole_file

__all__ = ["file_hash", "fingerprint", "versions", "write_json"]

_PACKAGES = ("warpjld", "numpy", "scipy", "warp-lang", "trimesh", "pyarrow")


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def fingerprint(identity: dict[str, Any]) -> str:
    """SHA-256 of settings, independent of their order."""
    return hashlib.sha256(
        json.dumps(identity, sort_keys=True, ensure_ascii=False).encode("utf-8", "backslashreplace")
    ).hexdigest()


def versions(packages: Iterable[str] = _PACKAGES) -> dict[str, str | None]:
    """Versions of packages, of Python and of the platform; None for packages that are not installed."""
    found: dict[str, str | None] = {}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    if found.get("warpjld") is None:  # run from a source tree
        from warpjld import __version__

        found["warpjld"] = __version__
    return found | {"python": sys.version.split()[0], "platform": platform.platform(), "machine": platform.machine()}


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file atomically."""
    with whole_file(path) as part:
        text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        part.write_bytes(text.encode("utf-8", "backslashreplace"))  # names with bytes that are not UTF-8 are escaped
