"""Built-in hands kept in files: building one takes seconds, reading it a few hundredths of one."""

from __future__ import annotations

import hashlib
import json
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from warpjld import __version__
from warpjld.files.kept_files import keep, kept_folder, used
from warpjld.hand.build import build_hand, hand_rig
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["kept_hand"]

_SKELETON = ("parents", "rest", "axes", "limits")


def kept_hand(side: str = "left", **options: Any) -> Rig:
    """``build_hand``, out of a file where the same hand was built before.

    Args:
        side: As of ``build_hand``, likewise ``options``.
    """
    folder = kept_folder()
    if folder is None:
        return build_hand(side, **options)
    what = json.dumps([__version__, _sources(), side, dict(sorted(options.items()))], default=str)
    file = folder / f"hand-{hashlib.sha256(what.encode()).hexdigest()}.npz"
    try:
        rig = _read(file, side)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):  # none, or not whole: it is built
        rig = build_hand(side, **options)
        keep(file, lambda place: _write(place, rig))
    else:
        used(file)
    return rig


def _write(place: Path, rig: Rig) -> None:
    skeleton = rig.skeleton
    np.savez(
        place,
        vertices=rig.surface.vertices,
        faces=rig.surface.faces,
        names=np.array(skeleton.names),
        palms=np.array(skeleton.palms),
        **{name: getattr(skeleton, name) for name in _SKELETON},
    )


def _read(place: Path, side: str) -> Rig:
    with np.load(place, allow_pickle=False) as file:
        names = tuple(str(name) for name in file["names"])
        palms = tuple(tuple((int(a), int(b)) for a, b in palm) for palm in file["palms"])
        skeleton = Skeleton(names, palms=palms, **{name: file[name] for name in _SKELETON})
        return hand_rig(side, skeleton, file["vertices"], file["faces"])


@cache
def _sources() -> str:
    """Hash of the programs that build: a version under way changes without its number."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for file in sorted([*folder.glob("*.py"), *folder.with_name("skeleton").rglob("*.py")]):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()
