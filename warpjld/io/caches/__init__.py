"""Vertex caches: files with a deformed surface per frame, for animation and scientific tools.

The surface is computed on welded vertices and exported in the vertex order of its source, so that faces, texture
coordinates and materials made for the source's mesh fit the cache.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import InputError
from warpjld.runtime.lazily import lazy_names

if TYPE_CHECKING:
    from warpjld.geometry.surface import Surface
    from warpjld.io.caches.cache import Cache
else:
    __getattr__ = lazy_names(__name__, {"Cache": "cache"})

__all__ = ["FORMATS", "Cache", "check_cache", "open_cache"]

#: Suffix → description, for help texts.
FORMATS = {
    ".usd": "USD, binary: a mesh with time-sampled points",
    ".usda": "USD as text",
    ".usdc": "USD, binary",
    ".abc": "Alembic: a polygon mesh with a sample of points a frame",
    ".pc2": "point cache 2 (Blender, Maya, 3ds Max), with its rest mesh as OBJ",
    ".mdd": "MDD point cache (Blender, Maya, LightWave), with its rest mesh as OBJ",
    ".obj": "one Wavefront OBJ a frame, numbered",
    ".npz": "NumPy arrays: vertices, faces, uv, rest, rate, frames",
    ".glb": "glTF binary with a morph target a frame, for short clips",
}

_WRITERS = {
    ".usd": ("usd", "UsdCache"),
    ".usda": ("usd_text", "UsdTextCache"),
    ".usdc": ("usd", "UsdCache"),
    ".abc": ("alembic", "AlembicCache"),
    ".pc2": ("pc2", "Pc2Cache"),
    ".mdd": ("mdd", "MddCache"),
    ".obj": ("obj", "ObjCache"),
    ".npz": ("npz", "NpzCache"),
    ".glb": ("glb", "GlbCache"),
}


def open_cache(
    path: str | Path,
    surface: Surface,
    *,
    frames: int,
    rate: float,
    start_frame: int = 0,
    name: str = "surface",
) -> Cache:
    """Open a cache for writing; the suffix determines the format (see `FORMATS`).

    Use it in a ``with`` statement. No file is left if the statement ends with an exception, or if the number of frames
    written differs from the one announced. Memory does not grow with the number of frames, except for ``.glb``, which
    is limited to short clips.

    Args:
        path: File to write; its folder is created if necessary. For ``.obj`` the name of the sequence: ``hand.obj``
            becomes ``hand.0000.obj``, ``hand.0001.obj``, … Beside ``hand.pc2`` and ``hand.mdd``, which hold
            positions only, ``hand.rest.obj`` is written: the rest mesh in the same vertex order.
        surface: The surface.
        frames: Number of frames that will be written.
        rate: Frames per second.
        start_frame: Number of the first frame.
        name: Name of the mesh inside the file.

    Raises:
        InputError: Unknown suffix, no frames, a clip too long for the format, or a place that cannot be written.
        MissingExtraError: USD without the extra ``usd``, Alembic without ``abc``.

    Examples:
        >>> from tempfile import mkdtemp
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering, motion = wj.bind(hand), wj.Motion(rate=25)
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 10, 1.2)  # rad
        >>> poses = motion.poses(hand.skeleton)
        >>> with wj.open_cache(Path(mkdtemp()) / "hand.npz", hand.surface, frames=len(poses), rate=25) as cache:
        ...     for _, block in covering.blocks(poses):
        ...         cache.write(block)
        >>> cache.files[0].name
        'hand.npz'
    """
    from warpjld.io.caches.cache import CacheTiming

    path = Path(path)
    cache: Cache = _kind(path)(path, surface, CacheTiming(frames=frames, rate=rate, start=start_frame, name=name))
    return cache


def check_cache(path: str | Path) -> None:
    """Check that a cache of this format can be written, before long computations.

    Raises:
        InputError: Unknown suffix.
        MissingExtraError: A library that the format needs is not installed.
    """
    _kind(Path(path)).check()


def _kind(path: Path) -> type[Cache]:
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        listed = "; ".join(f"{suffix} ({what})" for suffix, what in FORMATS.items())
        raise InputError(f"unknown kind of cache '{path.suffix}'; known: {listed}", path=path)
    module, kind = writer
    found: type[Cache] = getattr(import_module(f"{__name__}.{module}"), kind)
    return found
