"""Readers of rigs and meshes, writers of vertex caches."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.runtime.lazily import lazy_names

if TYPE_CHECKING:
    from warpjld.io.rig_file import load_rig
else:
    __getattr__ = lazy_names(
        __name__,
        {
            "load_rig": "rig_file",
        },
    )

__all__ = ["load_rig"]
