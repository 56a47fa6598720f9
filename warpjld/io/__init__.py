"""Readers of rigs and meshes, writers of vertex caches."""

from warpjld.io.rig_file import load_rig

__all__ = ["load_rig"]
