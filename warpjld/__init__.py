"""Joint-dependent Local Deformations on NVIDIA Warp: a surface follows a skeleton without painted weights."""

__version__ = "0.1.0"

__all__ = ["__version__"]
