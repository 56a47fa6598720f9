"""Reading rigs and motions, writing caches."""

from warpjld.io.rig_file import load_rig

__all__ = ["load_rig"]
