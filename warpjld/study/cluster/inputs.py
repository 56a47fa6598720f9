"""Input files for other machines, placed in Ray's object store and identified by their SHA-256."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.study.cluster.node import Sent

__all__ = ["sent_inputs"]


def sent_inputs(paths: Iterable[Path], put: Any) -> tuple[Sent, ...]:
    """Put files, and those they refer to (buffers of a .gltf, layers of a USD stage), into the object store.

    Args:
        paths: The files.
        put: ``ray.put``.

    Raises:
        InputError: One cannot be read.
    """
    from warpjld.io.identity import files_of  # workers, which import this module, do without

    held: dict[str, Any] = {}
    sent = []
    for path in dict.fromkeys(paths):
        files = [path, *files_of(path)]
        missing = [file for file in files if not file.is_file()]
        if missing:
            raise InputError("no such file", path=missing[0])
        base = Path(os.path.commonpath([file.absolute().parent for file in files]))
        listed, digest = [], hashlib.sha256()
        for file in dict.fromkeys(files):
            content = read_bytes(file)
            own = hashlib.sha256(content).hexdigest()
            if own not in held:
                held[own] = put(content)
            name = file.absolute().relative_to(base).as_posix()
            digest.update(f"{name}\0{own}\n".encode())
            listed.append((name, own, held[own]))
        sent.append(Sent(str(path), listed[0][0], digest.hexdigest(), tuple(listed)))
    return tuple(sent)
